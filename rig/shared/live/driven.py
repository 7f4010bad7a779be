"""The other end of a `Child` (child.py): a process that is driven by messages."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from tactileq.modeling.errors import InputError
from tactileq.rig.shared.live.messages import Message, Refused, decoded, received, send

Settings = TypeVar("Settings")


class Parent:
    """Who started this process, in a `with` block: it is told of an InputError that ends the block.

    It handles Ctrl-C and Ctrl-Z.
    """

    def __init__(self) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if sys.platform != "win32":
            # A stopped process cannot fade; a card may repeat indefinitely what it got last.
            signal.signal(signal.SIGTSTP, signal.SIG_IGN)
        # Not sys.stdin, whose lock a thread would still hold when the interpreter ends.
        self._received = received(os.fdopen(0, "rb", closefd=False))
        self._answers = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)  # what libraries print is no message

    def __enter__(self) -> Parent:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> bool:
        if isinstance(error, InputError):
            self.send(Refused(str(error)))
        return isinstance(error, InputError | BrokenPipeError)

    def settings(self, kind: type[Settings]) -> Settings:
        """What this process was started with."""
        return decoded(next(self._received, b""), kind)  # type: ignore[no-any-return]

    def send(self, message: Message) -> None:
        """Send a message."""
        send(self._answers, message)

    def serve(self, requests: Any, answer: Callable[[Any], Message]) -> None:
        """Answer each request (of this union) until the parent is gone; refuse any other."""
        for data in self._received:
            try:
                reply = answer(decoded(data, requests))
            except InputError as error:
                reply = Refused(str(error))
            self.send(reply)
