"""Signals that ask a program to end: it unwinds as after an exception, and cleans up."""

from __future__ import annotations

import signal
import sys
import time
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
SAME_S = 2.0  # some senders send twice, to the process and to its group
AGAIN_S = 0.01  # until an exception is raised again that was ignored


class Interrupted(SystemExit):
    """The program was asked to end by a signal; its code is 128 + the signal's number."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.number = number
        self.signal_name = signal.Signals(number).name


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Raise `Interrupted` in this block when a signal asks the program to end.

    Signals that are already ignored (nohup) stay ignored. A second signal within two seconds
    counts as the same one, so that it does not interrupt the clean-up.

    Python ignores an exception in a destructor, a callback of a weak reference or one called by C
    code, which is where a signal may arrive; it is then raised again a moment later.
    """
    last = -SAME_S
    ignore = sys.unraisablehook

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal last
        if time.monotonic() - last >= SAME_S:
            last = time.monotonic()
            raise Interrupted(number)

    def again(ignored: UnraisableHookArgs) -> None:
        nonlocal last
        if isinstance(ignored.exc_value, Interrupted):
            last = -SAME_S
            Timer(AGAIN_S, interrupt_main, [ignored.exc_value.number]).start()
        else:
            ignore(ignored)

    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, end)
    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = ignore
        for number, handler in before.items():
            signal.signal(number, handler)
