"""What processes of a rig say to each other: frozen types, in msgpack, each after its length.

Each process declares its own beside it. docs/method/live.md#messages
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO, Any

import msgspec

from modeling.errors import InputError

_LENGTH = 4  # bytes
_LONGEST = 2**29  # less than any four letters, should something else write into the pipe


class Message(msgspec.Struct, frozen=True, tag=True, forbid_unknown_fields=True):
    """One thing that is said, named by its class."""


class Done(Message, frozen=True):
    """What was asked for is done; at the start: it runs."""


class Refused(Message, frozen=True):
    """What was asked for cannot be done: one sentence."""

    told: str


def send(pipe: IO[bytes], message: object) -> None:
    """Write a message, in one piece."""
    data = msgspec.msgpack.encode(message)
    pipe.write(len(data).to_bytes(_LENGTH) + data)
    pipe.flush()


def received(pipe: IO[bytes]) -> Iterator[bytes]:
    """Messages as they come, to be decoded, until the pipe ends; one that is cut off is left out.

    Raises
    ------
    InputError
        If something else is written into it; nothing more can be read from it then.
    """
    while len(head := _read(pipe, _LENGTH)) == _LENGTH:
        length = int.from_bytes(head)
        if length > _LONGEST:
            raise _no_message(f"{bytes(head)!r}")
        if len(data := _read(pipe, length)) < length:
            return
        yield bytes(data)


def decoded(data: bytes, kinds: Any) -> Any:
    """A message of one of these types (a union or a type); InputError for any other."""
    try:
        return msgspec.msgpack.decode(data, type=kinds)
    except (msgspec.DecodeError, ValueError) as error:
        raise _no_message(str(error)) from None


def _read(pipe: IO[bytes], size: int) -> bytearray:
    """So many bytes, fewer where the pipe ends."""
    data = bytearray()
    while len(data) < size and (piece := pipe.read(size - len(data))):
        data += piece
    return data


def _no_message(got: str) -> InputError:
    return InputError(
        f"expected a message that this process of a rig knows, got another ({got}); start all "
        "processes from one installation."
    )
