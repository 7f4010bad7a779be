"""Signals that ask a program to end: it unwinds as after an exception, and cleans up.

A signal's exception is raised wherever the program happens to be, and not all code lets it through:
Python ignores what is raised in a destructor or in a callback of C code, and some libraries catch
everything (seen while a window of PsychoPy flipped, once in some 200 signals). The program would
then run on as if nobody had asked. So while the exception ought to unwind the program, a thread has
the main thread look twice a second: where the exception is neither being handled nor accepted, it
was lost, and is raised again.
"""

from __future__ import annotations

import signal
import sys
import time
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from threading import Thread
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
SAME_S = 2.0  # some senders send twice, to the process and to its group
LOOK_S = 0.5  # longer than destructors take, in which nobody sees that the program unwinds


class Interrupted(SystemExit):
    """The program was asked to end by a signal; its code is 128 + the signal's number."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.number = number
        self.signal_name = signal.Signals(number).name
        self.accepted = False

    def accept(self) -> None:
        """Said by who catches it and ends the program otherwise: it is not raised again."""
        self.accepted = True

    def is_handled(self) -> bool:
        """Whether the calling thread cleans up because of it: in `finally`, `except` or `with`."""
        error = sys.exception()
        while error is not None and error is not self:
            error = error.__context__
        return error is self


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Raise `Interrupted` in this block when a signal asks the program to end.

    Signals that are already ignored (nohup) stay ignored. A second signal within two seconds
    counts as the same one, so that it does not interrupt the clean-up.
    """
    watch = _Watch()
    ignore = sys.unraisablehook

    def quietly(ignored: UnraisableHookArgs) -> None:
        if not isinstance(ignored.exc_value, Interrupted):  # which the watch raises again
            ignore(ignored)

    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, watch.end)
    sys.unraisablehook = quietly
    try:
        yield
    except BaseException as error:
        if lost := watch.lost():  # ctypes, for one, makes an error of its own of it
            raise lost from error
        raise
    finally:
        watch.close()
        sys.unraisablehook = ignore
        for number, handler in before.items():
            signal.signal(number, handler)


class _Watch:
    """Raises what a signal asks for, and again where it was lost."""

    def __init__(self) -> None:
        self._raised: Interrupted | None = None
        self._raised_s = -SAME_S
        self._looks = False
        self._closed = False
        # A queue of this kind may be used in a signal handler, whatever it has interrupted.
        self._asked: SimpleQueue[int | None] = SimpleQueue()
        # From the start, since beginning a thread in a signal handler may wait forever.
        self._thread = Thread(target=self._watch, daemon=True)
        self._thread.start()

    def end(self, number: int, frame: FrameType | None) -> None:
        """The handler of the signals."""
        if self._closed:
            return
        if self._looks:
            self._looks = False
            if self.lost() is None:
                return
        elif time.monotonic() - self._raised_s < SAME_S:
            return
        self._raised_s = time.monotonic()
        self._raised = Interrupted(number)
        self._asked.put(number)
        raise self._raised

    def lost(self) -> Interrupted | None:
        """What was raised, where the calling thread neither handles nor has accepted it."""
        raised = self._raised
        return None if raised is None or raised.accepted or raised.is_handled() else raised

    def close(self) -> None:
        """Look no longer."""
        self._closed = True
        self._raised = None  # and with it the frames that it came through
        self._asked.put(None)
        self._thread.join()

    def _watch(self) -> None:
        asked = self._asked.get()
        while asked is not None:
            number = signal.Signals(asked)
            try:
                asked = self._asked.get(timeout=LOOK_S)
            except Empty:
                self._looks = True
                interrupt_main(number)
