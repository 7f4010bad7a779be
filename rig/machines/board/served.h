/* The device's side of the wire: good frames to registers, replies, hello. docs/device.md#the-wire

   A device's own header includes it after its registers.h and after it has defined tq_device, whose members
   board, values, reader, nonce, heard, greeted, expected, replied, reply and reply_bytes it uses; it declares
   what that header has to define. C99, no allocation.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SERVED_H
#define TQ_SERVED_H

#include "wire.h"

/* --- To be defined -------------------------------------------------------------------------------------- */

/* Whether a value is legal beside its range. */
static inline int tq_device_accepts(const tq_device *d, uint8_t address, const uint8_t *value);
/* Puts a checked value where it counts, under the lock; a status. */
static inline int tq_device_apply(tq_device *d, const tqd_register *r, const uint8_t *value);
/* The value of a register as it is now, under the lock. */
static inline void tq_device_look(tq_device *d, const tqd_register *r, uint8_t *value);
/* A frame of an upload, which it answers. */
static inline void tq_device_upload(tq_device *d, const tq_frame *f);
/* A host said hello: what was allowed for the one before is over. Under the lock. */
static inline void tq_device_greeted(tq_device *d);

/* --- Replies ------------------------------------------------------------------------------------------ */

static inline void tq_device_send(tq_device *d, const uint8_t *bytes, size_t count)
{
    if (d->board.room(d->board.context) >= count)
        d->board.send(d->board.context, bytes, count);
}

/* Sends a reply, and keeps it: a frame that is repeated is answered again and done once. */
static inline void tq_device_reply(tq_device *d, const tq_frame *f, int status, const uint8_t *body,
                                   size_t count)
{
    uint8_t whole[TQ_MOST_BODY];
    whole[0] = (uint8_t)status;
    if (count)
        memcpy(whole + 1, body, count);
    if (status != TQD_STATUS_OK)
        d->values.frames_refused++;
    d->reply_bytes = tq_stuffed((uint8_t)(f->kind | TQ_REPLY), f->sequence, d->nonce, whole,
                                (uint8_t)(count + 1), d->reply);
    tq_device_send(d, d->reply, d->reply_bytes);
}

static inline const tqd_register *tq_device_register(uint8_t address)
{
    int n;
    for (n = 0; n < TQD_REGISTERS; n++)
        if (tqd_registers[n].address == address)
            return &tqd_registers[n];
    return NULL;
}

/* Whether every element of a value lies within its range. */
static inline int tq_device_ranges(const tqd_register *r, const uint8_t *value)
{
    int n;
    for (n = 0; n < r->length; n++) {
        const tqd_range *range = &tqd_ranges[r->ranges + (r->each ? n : 0)];
        float x = 0;
        if (r->kind == TQD_FLOAT)
            memcpy(&x, value + 4 * n, 4);
        else if (r->bytes == 1)
            x = value[n];
        else if (r->bytes == 2)
            x = (float)(value[2 * n] | value[2 * n + 1] << 8);
        else
            continue; /* all values of 32 and 64 bits are legal */
        if (!(x >= range->low && x <= range->high))
            return 0;
    }
    return 1;
}

static inline void tq_device_read(tq_device *d, const tq_frame *f)
{
    uint8_t body[TQ_MOST_BODY];
    const tqd_register *r = f->length == 1 ? tq_device_register(f->body[0]) : NULL;
    if (f->length != 1) {
        tq_device_reply(d, f, TQD_STATUS_LENGTH, NULL, 0);
    } else if (!r) {
        tq_device_reply(d, f, TQD_STATUS_ADDRESS, f->body, 1);
    } else if (!(r->access & TQD_READS)) {
        tq_device_reply(d, f, TQD_STATUS_ACCESS, f->body, 1);
    } else {
        body[0] = r->address;
        d->board.lock(d->board.context);
        tq_device_look(d, r, body + 1);
        d->board.unlock(d->board.context);
        tq_device_reply(d, f, TQD_STATUS_OK, body, 1 + (size_t)r->bytes * r->length);
    }
}

static inline void tq_device_write(tq_device *d, const tq_frame *f)
{
    uint8_t body[TQ_MOST_BODY];
    const tqd_register *r = f->length ? tq_device_register(f->body[0]) : NULL;
    size_t size = r ? (size_t)r->bytes * r->length : 0;
    int status;
    if (!f->length)
        status = TQD_STATUS_LENGTH;
    else if (!r)
        status = TQD_STATUS_ADDRESS;
    else if (!(r->access & TQD_WRITES))
        status = TQD_STATUS_ACCESS;
    else if (f->length != 1 + size)
        status = TQD_STATUS_LENGTH;
    else if (!tq_device_ranges(r, f->body + 1) || !tq_device_accepts(d, r->address, f->body + 1))
        status = TQD_STATUS_RANGE;
    else {
        d->board.lock(d->board.context);
        status = tq_device_apply(d, r, f->body + 1);
        d->board.unlock(d->board.context);
    }
    memcpy(body, f->body, f->length);
    if (r && r->address == TQD_COMMAND && status == TQD_STATUS_OK)
        body[1] = d->values.state;
    tq_device_reply(d, f, status, body, status == TQD_STATUS_OK ? f->length : f->length ? 1 : 0);
}

/* The mixing of SplitMix64. */
static inline uint64_t tq_mixed(uint64_t z)
{
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

/* A host says hello: what it has to know, and from which number on it counts. Nothing is armed by it. */
static inline void tq_device_greet(tq_device *d, const tq_frame *f)
{
    uint8_t body[21];
    const tqd_values *v = &d->values;
    float rate = v->tick_rate;
    if (f->length) {
        tq_device_reply(d, f, TQD_STATUS_LENGTH, NULL, 0);
        return;
    }
    d->board.lock(d->board.context);
    tq_device_greeted(d);
    if (!d->greeted) /* the moment of the first hello is not foreseen, either */
        d->nonce = (uint32_t)tq_mixed((uint64_t)d->board.entropy << 32 | v->tick) | 1;
    d->greeted = 1, d->heard = v->tick;
    d->board.unlock(d->board.context);
    d->expected = (uint16_t)(f->sequence + 1);
    memcpy(body, &v->who_am_i, 2), memcpy(body + 2, &v->firmware_version, 2);
    memcpy(body + 4, &v->schema_hash, 8), memcpy(body + 12, &rate, 4);
    body[16] = v->real_size;
    memcpy(body + 17, &v->tick, 4);
    tq_device_reply(d, f, TQD_STATUS_OK, body, sizeof body);
}

/* A good frame. */
static inline void tq_device_frame(tq_device *d, const tq_frame *f)
{
    uint16_t check = (uint16_t)(tq_crc16(f->body, f->length) ^ f->kind);
    d->values.frames_good++;
    if (f->kind == TQ_HELLO) {
        tq_device_greet(d, f);
        return;
    }
    if (!d->greeted || f->nonce != d->nonce) {
        tq_device_reply(d, f, TQD_STATUS_NONCE, NULL, 0);
        return;
    }
    if (f->sequence == (uint16_t)(d->expected - 1) && check == d->replied && d->reply_bytes) {
        d->heard = d->values.tick;
        tq_device_send(d, d->reply, d->reply_bytes);
        return;
    }
    if (f->sequence != d->expected) {
        uint8_t kept[TQ_MOST_STUFFED];
        size_t bytes = d->reply_bytes;
        memcpy(kept, d->reply, bytes);
        tq_device_reply(d, f, TQD_STATUS_SEQUENCE, NULL, 0);
        memcpy(d->reply, kept, bytes), d->reply_bytes = bytes;
        return;
    }
    d->heard = d->values.tick, d->expected++, d->replied = check;
    switch (f->kind) {
    case TQ_READ: tq_device_read(d, f); break;
    case TQ_WRITE: tq_device_write(d, f); break;
    case TQ_UPLOAD: tq_device_upload(d, f); break;
    default: tq_device_reply(d, f, TQD_STATUS_KIND, NULL, 0); break;
    }
}

/* Bytes from the host. */
static inline void tq_device_received(tq_device *d, const uint8_t *bytes, size_t count)
{
    tq_frame frame;
    for (; count; count--, bytes++)
        if (tq_reader_take(&d->reader, *bytes, &frame))
            tq_device_frame(d, &frame);
}

#endif
