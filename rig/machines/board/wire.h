/* Frames on the wire: COBS between zeros, with sequence, nonce, length and a CRC. docs/device.md#frames

   C99, no library but memcpy, no allocation. A frame is handed on only once its CRC and length are right;
   what is damaged is counted and dropped.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_WIRE_H
#define TQ_WIRE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { TQ_HELLO = 1, TQ_READ, TQ_WRITE, TQ_UPLOAD, TQ_EVENT, TQ_REPLY = 0x80 };
enum { TQ_HEADER = 8, TQ_MOST_BODY = 236, TQ_MOST_PLAIN = TQ_HEADER + TQ_MOST_BODY + 4 };
enum { TQ_MOST_STUFFED = TQ_MOST_PLAIN + 1 + 2 }; /* zeros included */

typedef struct {
    uint8_t kind, length;
    uint16_t sequence;
    uint32_t nonce;
    const uint8_t *body;
} tq_frame;

/* Bytes since the last zero. */
typedef struct {
    uint8_t bytes[TQ_MOST_PLAIN + 1];
    size_t count;
    int too_long;
    uint32_t bad;
} tq_reader;

static inline uint16_t tq_crc16(const uint8_t *bytes, size_t count)
{
    uint16_t crc = 0xFFFF;
    for (; count; count--, bytes++) { /* four bits at a time, without a table */
        uint16_t x = (uint16_t)((crc >> 8) ^ *bytes);
        x = (uint16_t)(x ^ (x >> 4));
        crc = (uint16_t)((crc << 8) ^ (x << 12) ^ (x << 5) ^ x);
    }
    return crc;
}

static inline uint32_t tq_crc32(const uint8_t *bytes, size_t count)
{
    static const uint32_t nibble[16] = {
        0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
        0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
    };
    uint32_t crc = 0xFFFFFFFF;
    for (; count; count--, bytes++) {
        crc = nibble[(crc ^ *bytes) & 15] ^ (crc >> 4);
        crc = nibble[(crc ^ (uint32_t)(*bytes >> 4)) & 15] ^ (crc >> 4);
    }
    return ~crc;
}

/* A hello has neither nonce nor number, and an upload no ranges, that would catch what CRC-16 lets pass. */
static inline int tq_has_crc32(uint8_t kind)
{
    return (kind & 0x7F) == TQ_HELLO || (kind & 0x7F) == TQ_UPLOAD;
}

/* Unstuffs in place; how many bytes, 0 for what is no COBS. */
static inline size_t tq_unstuffed(uint8_t *bytes, size_t count)
{
    size_t from = 0, to = 0;
    while (from < count) {
        size_t code = bytes[from++], n;
        if (code == 0 || from + code - 1 > count)
            return 0;
        for (n = 1; n < code; n++)
            bytes[to++] = bytes[from++];
        if (code < 255 && from < count)
            bytes[to++] = 0;
    }
    return to;
}

/* The frame that these bytes between two zeros are, which are unstuffed in place; whether it is one. */
static inline int tq_frame_of(uint8_t *bytes, size_t count, tq_frame *frame)
{
    size_t plain = tq_unstuffed(bytes, count), end;
    if (plain < TQ_HEADER + 2)
        return 0;
    frame->kind = bytes[0], frame->length = bytes[7], frame->body = bytes + TQ_HEADER;
    frame->sequence = (uint16_t)(bytes[1] | bytes[2] << 8);
    memcpy(&frame->nonce, bytes + 3, 4);
    end = TQ_HEADER + (size_t)frame->length;
    if (frame->length > TQ_MOST_BODY)
        return 0;
    if (tq_has_crc32(frame->kind)) {
        uint32_t sent;
        memcpy(&sent, bytes + end, plain == end + 4 ? 4 : 0);
        return plain == end + 4 && sent == tq_crc32(bytes, end);
    }
    return plain == end + 2 && (bytes[end] | bytes[end + 1] << 8) == tq_crc16(bytes, end);
}

/* Takes one byte in; whether it completes a frame, which stays good until the next byte. */
static inline int tq_reader_take(tq_reader *r, uint8_t byte, tq_frame *frame)
{
    size_t count = r->count;
    int too_long = r->too_long;
    if (byte) {
        if (count < sizeof r->bytes)
            r->bytes[r->count++] = byte;
        else
            r->too_long = 1;
        return 0;
    }
    r->count = 0, r->too_long = 0;
    if (count == 0)
        return 0;
    if (!too_long && tq_frame_of(r->bytes, count, frame))
        return 1;
    r->bad++;
    return 0;
}

/* A frame as it is sent, a zero before and after; how many bytes of at most TQ_MOST_STUFFED. */
static inline size_t tq_stuffed(uint8_t kind, uint16_t sequence, uint32_t nonce, const uint8_t *body,
                                uint8_t length, uint8_t *out)
{
    uint8_t plain[TQ_MOST_PLAIN];
    size_t count = TQ_HEADER + (size_t)length, n, code = 1, to = 2;
    plain[0] = kind, plain[1] = (uint8_t)sequence, plain[2] = (uint8_t)(sequence >> 8), plain[7] = length;
    memcpy(plain + 3, &nonce, 4);
    if (length)
        memcpy(plain + TQ_HEADER, body, length);
    if (tq_has_crc32(kind)) {
        uint32_t crc = tq_crc32(plain, count);
        memcpy(plain + count, &crc, 4);
        count += 4;
    } else {
        uint16_t crc = tq_crc16(plain, count);
        memcpy(plain + count, &crc, 2);
        count += 2;
    }
    out[0] = 0;
    for (n = 0; n < count; n++) { /* never 254 bytes without a zero: one block, or ends of blocks */
        if (plain[n]) {
            out[to++] = plain[n];
        } else {
            out[code] = (uint8_t)(to - code);
            code = to++;
        }
    }
    out[code] = (uint8_t)(to - code);
    out[to++] = 0;
    return to;
}

#endif
