/* The lines of a serial sensor for tactileq, for any micro-controller: C99, no library.
   docs/serial-sensor.md describes them. Each function writes one line into `line` (TQ_LINE bytes
   or more), ends it with \r\n and returns its length. */
#ifndef TACTILEQ_LINE_H
#define TACTILEQ_LINE_H

#include <stdint.h>

#define TQ_LINE 82
#define TQ_FIRMWARE 40 /* characters of a version; the rest is cut off */
#define TQ_NO_FORCE INT32_MIN /* force is not measured: the field stays empty */
#define TQ_CONTACT 1u
#define TQ_BUTTON 2u

/* CRC-16/XMODEM: polynomial 0x1021, from 0; 0x31C3 for "123456789". */
static uint16_t tq_crc(const char *text, uint8_t length)
{
    uint16_t crc = 0;
    for (uint8_t i = 0; i < length; i++) {
        crc ^= (uint16_t)((uint16_t)(uint8_t)text[i] << 8);
        for (uint8_t bit = 0; bit < 8; bit++)
            crc = (uint16_t)((crc & 0x8000u) ? (uint32_t)crc << 1 ^ 0x1021u : (uint32_t)crc << 1);
    }
    return crc;
}

static uint8_t tq_put_unsigned(char *line, uint8_t at, uint32_t value)
{
    char digits[10];
    uint8_t count = 0;
    do {
        digits[count++] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value);
    while (count)
        line[at++] = digits[--count];
    return at;
}

/* A comma and a number; TQ_NO_FORCE is an empty field. */
static uint8_t tq_put(char *line, uint8_t at, int32_t value)
{
    line[at++] = ',';
    if (value == TQ_NO_FORCE)
        return at;
    if (value < 0) {
        line[at++] = '-';
        return tq_put_unsigned(line, at, 0u - (uint32_t)value);
    }
    return tq_put_unsigned(line, at, (uint32_t)value);
}

static uint8_t tq_begin(char *line, char kind, uint16_t number, uint32_t time_us)
{
    uint8_t at = 0;
    line[at++] = '$';
    line[at++] = kind;
    line[at++] = ',';
    at = tq_put_unsigned(line, at, number);
    line[at++] = ',';
    return tq_put_unsigned(line, at, time_us);
}

static uint8_t tq_close(char *line, uint8_t at)
{
    uint16_t crc = tq_crc(line + 1, (uint8_t)(at - 1));
    line[at++] = '*';
    for (int8_t shift = 12; shift >= 0; shift = (int8_t)(shift - 4))
        line[at++] = "0123456789ABCDEF"[crc >> shift & 15];
    line[at++] = '\r';
    line[at++] = '\n';
    return at;
}

static uint8_t tq_end(char *line, uint8_t at, int32_t force_mn, uint8_t flags)
{
    at = tq_put(line, at, force_mn);
    at = tq_put(line, at, flags);
    return tq_close(line, at);
}

/* The version of the firmware: ASCII without $, * and control characters. Twice a second or so. */
static uint8_t tq_firmware_line(char *line, const char *version)
{
    uint8_t at = 0;
    line[at++] = '$';
    line[at++] = 'F';
    line[at++] = ',';
    for (uint8_t i = 0; i < TQ_FIRMWARE && version[i]; i++)
        line[at++] = version[i];
    return tq_close(line, at);
}

/* Position in µm, force in mN. */
static uint8_t tq_position_line(char *line, uint16_t number, uint32_t time_us, int32_t x_um,
                                int32_t y_um, int32_t force_mn, uint8_t flags)
{
    uint8_t at = tq_begin(line, 'P', number, time_us);
    at = tq_put(line, at, x_um);
    at = tq_put(line, at, y_um);
    return tq_end(line, at, force_mn, flags);
}

/* Signed speed in µm/s, force in mN. */
static uint8_t tq_speed_line(char *line, uint16_t number, uint32_t time_us, int32_t speed_um_s,
                             int32_t force_mn, uint8_t flags)
{
    uint8_t at = tq_begin(line, 'V', number, time_us);
    at = tq_put(line, at, speed_um_s);
    return tq_end(line, at, force_mn, flags);
}

#endif
