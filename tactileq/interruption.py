"""Signals that ask a program to end: it unwinds as after an exception, and cleans up."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
SAME_S = 2.0  # some senders send twice, to the process and to its group


class Interrupted(SystemExit):
    """The program was asked to end by a signal; its code is 128 + the signal's number."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.signal_name = signal.Signals(number).name


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Raise `Interrupted` in this block when a signal asks the program to end.

    Signals that are already ignored (nohup) stay ignored. A second signal within two seconds
    counts as the same one, so that it does not interrupt the clean-up.
    """
    last = -SAME_S

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal last
        if time.monotonic() - last >= SAME_S:
            last = time.monotonic()
            raise Interrupted(number)

    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
