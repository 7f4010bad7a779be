"""A client of the cable device's wire protocol, for pseudo-terminals and TCP sockets.

It was written from docs/device.md, docs/device-registers.md and docs/device/vectors.json alone and
imports nothing of tactileq: that it can talk to every device shows that the pages are enough.
"""

from __future__ import annotations

import binascii
import json
import os
import select
import socket
import struct
import time
import tty
import zlib
from pathlib import Path

_VECTORS = Path(__file__).parents[4] / "docs/device/vectors.json"
SCHEMA_HASH = int(json.loads(_VECTORS.read_text(encoding="utf-8"))["schemaHash"], 16)

HELLO, READ, WRITE, UPLOAD, EVENT = 1, 2, 3, 4, 5
FROM_DEVICE = 128
OK, NONCE, SEQUENCE, BUSY = 0, 6, 7, 11

RESEND_AFTER = 0.3
GIVE_UP_AFTER = 3.0
MOST_BODY = 236
MOST_CHUNK = MOST_BODY - 5
MOST_STUFFED = 250

_HEADER = struct.Struct("<BHIB")
_HELLO = struct.Struct("<HHQfBI")
_EVENT = struct.Struct("<IIHB")
_RECORD = struct.Struct("<fffffB")

Record = tuple[int, int, float, float, float, float, float, int]
Frame = tuple[int, int, int, bytes]


class Refused(Exception):
    """The device answered with a status other than OK."""

    def __init__(self, status: int) -> None:
        """Keep the status, the first byte of the reply's body."""
        super().__init__(f"the device refused with status {status}")
        self.status = status


class ProtocolError(Exception):
    """The device's answer is not what the protocol says, or its registers are others."""


def cobs_encode(data: bytes) -> bytes:
    """Stuff data so that it holds no zero."""
    out = bytearray()
    block = bytearray()
    open_block = True
    for byte in data:
        open_block = True
        if byte == 0:
            out.append(len(block) + 1)
            out += block
            block.clear()
            continue
        block.append(byte)
        if len(block) == 254:
            out.append(255)
            out += block
            block.clear()
            open_block = False
    if open_block:
        out.append(len(block) + 1)
        out += block
    return bytes(out)


def cobs_decode(data: bytes) -> bytes | None:
    """Undo cobs_encode; None where data cannot be the result of it."""
    out = bytearray()
    at = 0
    while at < len(data):
        code = data[at]
        end = at + code
        if code == 0 or end > len(data) or 0 in data[at + 1 : end]:
            return None
        out += data[at + 1 : end]
        if code < 255 and end < len(data):
            out.append(0)
        at = end
    return bytes(out)


def check_of(kind: int, data: bytes) -> bytes:
    """Check of a frame's header and body: 4 bytes of hello and upload, else 2."""
    if kind % FROM_DEVICE in (HELLO, UPLOAD):
        return struct.pack("<I", zlib.crc32(data))
    return struct.pack("<H", binascii.crc_hqx(data, 0xFFFF))


def encode_frame(kind: int, sequence: int, nonce: int, body: bytes) -> bytes:
    """Bytes of a whole frame as they go over the wire, with the zeros around it."""
    if len(body) > MOST_BODY:
        raise ValueError(f"a body has at most {MOST_BODY} bytes, not {len(body)}")
    data = _HEADER.pack(kind, sequence, nonce, len(body)) + body
    return b"\0" + cobs_encode(data + check_of(kind, data)) + b"\0"


def decode_frame(stuffed: bytes) -> Frame | None:
    """Kind, sequence, nonce and body of what stood between two zeros; None if damaged."""
    data = cobs_decode(stuffed)
    if data is None or len(data) < _HEADER.size:
        return None
    kind, sequence, nonce, length = _HEADER.unpack_from(data)
    end = _HEADER.size + length
    if length > MOST_BODY or data[end:] != check_of(kind, data[:end]):
        return None
    return kind, sequence, nonce, data[_HEADER.size : end]


def decode_event(body: bytes) -> list[Record]:
    """Records of an event frame's body."""
    if len(body) < _EVENT.size:
        raise ProtocolError("an event frame is too short")
    number, tick, step, count = _EVENT.unpack_from(body)
    if len(body) != _EVENT.size + count * _RECORD.size:
        raise ProtocolError(f"an event frame with {count} records has {len(body)} bytes")
    records: list[Record] = []
    for index, values in enumerate(_RECORD.iter_unpack(body[_EVENT.size :])):
        x, depth, speed, force, vibration, flags = values
        records.append(
            (
                (number + index) % 2**32,
                (tick + index * step) % 2**32,
                x,
                depth,
                speed,
                force,
                vibration,
                flags,
            )
        )
    return records


def fnv1a(data: bytes) -> int:
    """FNV-1a of data, 64 bits."""
    value = 0xCBF29CE484222325
    for byte in data:
        value = ((value ^ byte) * 0x100000001B3) % 2**64
    return value


class Client:
    """One conversation with a device; hello() comes before everything else."""

    def __init__(self, address: str) -> None:
        """Open a pseudo-terminal's path or socket://HOST:PORT."""
        self._socket: socket.socket | None = None
        if address.startswith("socket://"):
            host, _, port = address.removeprefix("socket://").rpartition(":")
            self._socket = socket.create_connection((host.strip("[]"), int(port)), GIVE_UP_AFTER)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setblocking(False)
            self._fd = self._socket.fileno()
        else:
            self._fd = os.open(address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            try:
                tty.setraw(self._fd)
            except BaseException:
                os.close(self._fd)
                raise
        self._received = bytearray()
        self._sequence = int.from_bytes(os.urandom(2), "little")
        self._nonce: int | None = None
        self._records: list[Record] = []

    def close(self) -> None:
        """Close the connection; a second call does nothing."""
        if self._fd < 0:
            return
        if self._socket is not None:
            self._socket.close()
        else:
            os.close(self._fd)
        self._fd = -1

    def hello(self) -> dict[str, int | float]:
        """Begin a conversation; fields of the reply by register name, and 'nonce'."""
        self._nonce = None
        nonce, body = self._exchange(HELLO, 0, b"")
        if len(body) != _HELLO.size:
            raise ProtocolError(f"the reply to hello has {len(body)} bytes, not {_HELLO.size}")
        who, version, schema, rate, real, tick = _HELLO.unpack(body)
        if schema != SCHEMA_HASH:
            raise ProtocolError(f"the device's SchemaHash is {schema:016x}, not {SCHEMA_HASH:016x}")
        self._nonce = nonce
        return {
            "WhoAmI": who,
            "FirmwareVersion": version,
            "SchemaHash": schema,
            "TickRate": rate,
            "RealSize": real,
            "Tick": tick,
            "nonce": nonce,
        }

    def read(self, address: int) -> bytes:
        """Value of a register."""
        return self._register(READ, address, b"")

    def write(self, address: int, value: bytes) -> bytes:
        """Write a register; the value that the device applied."""
        return self._register(WRITE, address, value)

    def upload(self, data: bytes) -> None:
        """Send a model; tried again for a while where the one before still fades out."""
        self._upload_step(0, struct.pack("<I", len(data)), 0)
        for offset in range(0, len(data), MOST_CHUNK):
            chunk = data[offset : offset + MOST_CHUNK]
            self._upload_step(1, struct.pack("<I", offset) + chunk, offset + len(chunk))
        self._upload_step(2, struct.pack("<Q", fnv1a(data)), len(data))

    def records(self, seconds: float) -> list[Record]:
        """Records kept so far and those that arrive within the given seconds."""
        until = time.monotonic() + seconds
        self._receive(0.0)
        while (left := until - time.monotonic()) > 0:
            self._receive(left)
        kept, self._records = self._records, []
        return kept

    def _register(self, kind: int, address: int, value: bytes) -> bytes:
        """Read or write a register; the value in the reply."""
        body = self._talk(kind, bytes([address]) + value)
        if not body or body[0] != address:
            raise ProtocolError(f"the reply is not about register {address}")
        return body[1:]

    def _upload_step(self, step: int, body: bytes, so_far: int) -> None:
        """Send one part of an upload and check how many bytes the device has."""
        until = time.monotonic() + GIVE_UP_AFTER
        while True:
            try:
                reply = self._talk(UPLOAD, bytes([step]) + body)
                break
            except Refused as refused:
                if refused.status != BUSY or time.monotonic() >= until:
                    raise
            self._receive(0.02)
        if reply != struct.pack("<BI", step, so_far):
            raise ProtocolError(f"the device does not have the {so_far} bytes sent to it")

    def _talk(self, kind: int, body: bytes) -> bytes:
        """Exchange a frame within a conversation; the reply's body after its status."""
        if self._nonce is None:
            raise ProtocolError("say hello first")
        nonce = self._nonce
        try:
            answered, reply = self._exchange(kind, nonce, body)
        except TimeoutError:
            self._nonce = None
            raise
        except Refused as refused:
            if refused.status in (NONCE, SEQUENCE):
                self._nonce = None
            raise
        if answered != nonce:
            self._nonce = None
            raise ProtocolError("the reply has another nonce than the conversation")
        return reply

    def _exchange(self, kind: int, nonce: int, body: bytes) -> tuple[int, bytes]:
        """Send a frame until its reply comes; the reply's nonce and body after its status."""
        sequence = (self._sequence + 1) % 65536
        frame = encode_frame(kind, sequence, nonce, body)
        self._sequence = sequence
        start = time.monotonic()
        until = start + GIVE_UP_AFTER
        resend = start
        while (now := time.monotonic()) < until:
            if now >= resend:
                self._send(frame, until)
                resend = time.monotonic() + RESEND_AFTER
            wait = min(resend, until) - time.monotonic()
            for answered, number, device, reply in self._receive(max(wait, 0.0)):
                if answered != kind + FROM_DEVICE or number != sequence:
                    continue
                if not reply:
                    raise ProtocolError("a reply has no status")
                if reply[0] != OK:
                    raise Refused(reply[0])
                return device, reply[1:]
        raise TimeoutError(f"no reply within {GIVE_UP_AFTER:g} s")

    def _send(self, frame: bytes, until: float) -> None:
        """Write all bytes of a frame; what comes meanwhile is left to be read later."""
        rest = memoryview(frame)
        while rest:
            left = until - time.monotonic()
            if left <= 0:
                raise TimeoutError("the device takes no bytes")
            if select.select([], [self._fd], [], left)[1]:
                try:
                    rest = rest[os.write(self._fd, rest) :]
                except BlockingIOError:
                    continue

    def _receive(self, seconds: float) -> list[Frame]:
        """Wait for bytes at most so long; the good frames among them but events, kept apart."""
        if not select.select([self._fd], [], [], max(seconds, 0.0))[0]:
            return []
        try:
            data = os.read(self._fd, 65536)
        except BlockingIOError:
            return []
        if not data:
            raise ConnectionError("the device has closed the connection")
        self._received += data
        *whole, rest = bytes(self._received).split(b"\0")
        # A start longer than any frame cannot become one; the next zero ends it.
        self._received = bytearray(rest[: MOST_STUFFED + 1])
        replies: list[Frame] = []
        for stuffed in whole:
            frame = decode_frame(stuffed) if 0 < len(stuffed) <= MOST_STUFFED else None
            if frame is None:
                continue
            if frame[0] != EVENT + FROM_DEVICE:
                replies.append(frame)
            elif frame[2] == self._nonce:
                self._records += decode_event(frame[3])
        return replies
