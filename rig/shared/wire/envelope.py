"""The envelope: frames as bytes, and bytes as they come as frames (docs/device.md#frames)."""

from __future__ import annotations

import binascii
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

from tactileq.modeling.errors import InputError
from tactileq.modeling.extras import extra
from tactileq.rig.shared.wire.definition import MOST_BODY

with extra("rig"):
    from cobs import cobs

_HEADER = struct.Struct("<BHIB")  # kind, sequence, nonce, length of the body
LONGEST = _HEADER.size + MOST_BODY + 4  # bytes of a frame before it is stuffed, one block of COBS


class Kind(IntEnum):
    """What a frame is; a reply has the highest bit set, too."""

    HELLO = 1
    READ = 2
    WRITE = 3
    UPLOAD = 4
    EVENT = 5


REPLY = 0x80


@dataclass(frozen=True)
class WireFrame:
    """One frame.

    Parameters
    ----------
    kind : int
        A `Kind`, with `REPLY` added by the device.
    sequence : int
        0 … 65535.
    nonce : int
        Of the start of the device, 0 … 2³² − 1; 0 in a hello.
    body : bytes
        At most 236.
    """

    kind: int
    sequence: int
    nonce: int
    body: bytes = b""

    def encoded(self) -> bytes:
        """As it is sent, with a zero before and after.

        Raises
        ------
        InputError
            For a body that is too long.
        """
        if len(self.body) > MOST_BODY:
            raise InputError(
                f"expected at most {MOST_BODY} bytes in a frame, got {len(self.body)}; send less "
                "at a time."
            )
        plain = _HEADER.pack(self.kind, self.sequence, self.nonce, len(self.body)) + self.body
        stuffed: bytes = cobs.encode(plain + _check(self.kind, plain))
        return b"\0" + stuffed + b"\0"

    @classmethod
    def decoded(cls, stuffed: bytes) -> WireFrame | None:
        """The frame that these bytes between two zeros are; None for a damaged one."""
        try:
            plain: bytes = cobs.decode(stuffed)
        except cobs.DecodeError:
            return None
        if len(plain) < _HEADER.size or len(plain) > LONGEST:
            return None
        kind, sequence, nonce, length = _HEADER.unpack_from(plain)
        end = _HEADER.size + length
        if length > MOST_BODY or plain[end:] != _check(kind, plain[:end]):
            return None
        return cls(kind, sequence, nonce, plain[_HEADER.size : end])


def _check(kind: int, plain: bytes) -> bytes:
    """CRC-16/IBM-3740; CRC-32 of what neither number nor range protects: hello and upload."""
    if kind & ~REPLY in (Kind.HELLO, Kind.UPLOAD):
        return zlib.crc32(plain).to_bytes(4, "little")
    return binascii.crc_hqx(plain, 0xFFFF).to_bytes(2, "little")


class WireReader:
    """Finds frames in bytes as they come; what is damaged is counted."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._too_long = False
        self.good = 0
        self.bad = 0

    def feed(self, data: bytes) -> Iterator[WireFrame]:
        """The frames that these bytes complete."""
        *ended, rest = data.split(b"\0")
        for part in ended:
            self._add(part)
            if (frame := self._take()) is not None:
                yield frame
        self._add(rest)

    def _add(self, part: bytes) -> None:
        self._bytes += part
        if len(self._bytes) > LONGEST + 1:
            self._too_long = True
            self._bytes.clear()

    def _take(self) -> WireFrame | None:
        stuffed, too_long = bytes(self._bytes), self._too_long
        self._bytes.clear()
        self._too_long = False
        if not stuffed and not too_long:
            return None
        frame = None if too_long else WireFrame.decoded(stuffed)
        self.good += frame is not None
        self.bad += frame is None
        return frame
