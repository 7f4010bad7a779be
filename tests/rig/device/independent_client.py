"""A client of the device that was written from docs/device.md and docs/device-registers.md alone.

It imports nothing of tactileq; that it can talk to every device shows that the page is enough.
"""

from __future__ import annotations

import binascii
import os
import select
import socket
import struct
import time
import tty
import zlib

AGAIN_S = 0.3
PATIENCE_S = 3.0
HELLO, READ, WRITE, UPLOAD, EVENT = 1, 2, 3, 4, 5
FROM_DEVICE = 128


class Refused(Exception):
    """A reply whose status is not 0."""

    def __init__(self, status: int) -> None:
        super().__init__(f"status {status}")
        self.status = status


def stuffed(data: bytes) -> bytes:
    """Consistent overhead byte stuffing of less than 254 bytes."""
    return b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0"))


def unstuffed(data: bytes) -> bytes | None:
    """What was stuffed; None for what is none."""
    parts = []
    while data:
        code = data[0]
        if code == 0 or code > len(data):
            return None
        parts.append(data[1:code])
        data = data[code:]
    return b"\0".join(parts)


def checked(data: bytes) -> bytes:
    """Header and body with their check."""
    if data[0] % FROM_DEVICE in (HELLO, UPLOAD):
        return data + struct.pack("<I", zlib.crc32(data))
    return data + struct.pack("<H", binascii.crc_hqx(data, 0xFFFF))


class Client:
    """A device at a pseudo-terminal's path or socket://HOST:PORT."""

    def __init__(self, address: str) -> None:
        self._socket: socket.socket | None = None
        if address.startswith("socket://"):
            host, _, port = address.removeprefix("socket://").rpartition(":")
            self._socket = socket.create_connection((host, int(port)))
            self._file = self._socket.fileno()
        else:
            self._file = os.open(address, os.O_RDWR | os.O_NOCTTY)
            tty.setraw(self._file)
        self._received = b""
        self._sequence = 0
        self._nonce = 0
        self._records: list[tuple[float, ...]] = []

    def hello(self) -> dict[str, float]:
        """What the device says of itself."""
        self._sequence, self._nonce = 0, 0
        nonce, body = self._ask(HELLO, b"")
        self._nonce = nonce
        names = ("WhoAmI", "FirmwareVersion", "SchemaHash", "TickRate", "RealSize", "Tick")
        return dict(zip(names, struct.unpack("<HHQfBI", body), strict=True)) | {"nonce": nonce}

    def read(self, address: int) -> bytes:
        """The bytes of a register."""
        return self._ask(READ, bytes([address]))[1][1:]

    def write(self, address: int, value: bytes) -> bytes:
        """The bytes that the device applied."""
        return self._ask(WRITE, bytes([address]) + value)[1][1:]

    def upload(self, data: bytes) -> None:
        """Send a model."""
        self._ask(UPLOAD, struct.pack("<BI", 0, len(data)))
        for at in range(0, len(data), 200):
            self._ask(UPLOAD, struct.pack("<BI", 1, at) + data[at : at + 200])
        digest = 0xCBF29CE484222325
        for byte in data:
            digest = ((digest ^ byte) * 0x100000001B3) % 2**64
        self._ask(UPLOAD, struct.pack("<BQ", 2, digest))

    def records(self, seconds: float) -> list[tuple[float, ...]]:
        """Number, tick, x, depth, speed, force, vibration, flags of what comes meanwhile.

        The device is asked for its state now and then, lest it takes the host for gone.
        """
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.read(8)
            self._listen(0.02)
        found, self._records = self._records, []
        return found

    def close(self) -> None:
        """Give the port back."""
        if self._socket is not None:
            self._socket.close()
        else:
            os.close(self._file)

    def _ask(self, kind: int, body: bytes) -> tuple[int, bytes]:
        head = struct.pack("<BHIB", kind, self._sequence, self._nonce, len(body))
        frame = b"\0" + stuffed(checked(head + body)) + b"\0"
        number, self._sequence = self._sequence, (self._sequence + 1) % 2**16
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            os.write(self._file, frame)
            again_s = time.monotonic() + AGAIN_S
            while (left_s := again_s - time.monotonic()) > 0:
                for got_kind, got_number, nonce, answer in self._listen(left_s):
                    if got_kind == kind + FROM_DEVICE and got_number == number:
                        if answer[0]:
                            raise Refused(answer[0])
                        return nonce, answer[1:]
        raise TimeoutError(f"no reply for {PATIENCE_S} s")

    def _listen(self, seconds: float) -> list[tuple[int, int, int, bytes]]:
        """Replies that come, at once or within this time; records are kept."""
        if not select.select([self._file], [], [], seconds)[0]:
            return []
        *frames, self._received = (self._received + os.read(self._file, 4096)).split(b"\0")
        replies = []
        for frame in frames:
            data = unstuffed(frame) or b""
            size = 4 if data and data[0] % FROM_DEVICE in (HELLO, UPLOAD) else 2
            if len(data) < 8 + size or checked(data[:-size]) != data:
                continue
            kind, number, nonce, length = struct.unpack_from("<BHIB", data)
            body = data[8 : 8 + length]
            if kind == EVENT + FROM_DEVICE:
                self._keep(body)
            else:
                replies.append((kind, number, nonce, body))
        return replies

    def _keep(self, body: bytes) -> None:
        number, tick, every, count = struct.unpack_from("<IIHB", body)
        for n, record in enumerate(struct.iter_unpack("<5fB", body[11 : 11 + 21 * count])):
            self._records.append((number + n, tick + n * every, *record))
