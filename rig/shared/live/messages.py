"""What processes of a rig say to each other: frozen types, in msgpack, each after its length.

Each process declares its own beside it. docs/method/live.md#messages
"""

from __future__ import annotations

from collections.abc import Iterator
from operator import methodcaller
from typing import IO, Any

import msgspec

from tactileq.modeling.errors import InputError

_LENGTH = 4  # bytes
_LONGEST = 2**29  # less than any four letters, should something else write into the pipe


class Message(msgspec.Struct, frozen=True, tag=True, forbid_unknown_fields=True):
    """One thing that is said, named by its class."""


class Done(Message, frozen=True):
    """What was asked for is done; at the start: it runs."""


class Refused(Message, frozen=True):
    """What was asked for cannot be done: one sentence."""

    sentence: str


def send(pipe: IO[bytes], message: object) -> None:
    """Write a message, in one piece."""
    data = msgspec.msgpack.encode(message, enc_hook=methodcaller("item"))  # numbers of NumPy
    pipe.write(len(data).to_bytes(_LENGTH) + data)
    pipe.flush()


def received(pipe: IO[bytes]) -> Iterator[bytes]:
    """Messages as they come, until the pipe ends; one that is cut off is left out.

    They are to be decoded, which refuses what something else wrote into the pipe.
    """
    while len(head := pipe.read(_LENGTH)) == _LENGTH:
        length = int.from_bytes(head)
        data = head if length > _LONGEST else pipe.read(length)
        if data is head or len(data) == length:
            yield data


def decoded(data: bytes, kinds: Any) -> Any:
    """A message of one of these types (a union or a type); InputError for any other."""
    try:
        return msgspec.msgpack.decode(data, type=kinds)
    except (msgspec.DecodeError, ValueError) as error:
        raise InputError(
            f"expected a message that this process of a rig knows, got another ({error}); start "
            "all processes from one installation."
        ) from None
