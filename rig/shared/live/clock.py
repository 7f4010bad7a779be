"""The one clock of all processes of a rig: waiting by it, and giving it from outside (clock.h).

docs/method/live.md#clock
"""

from __future__ import annotations

import mmap
import os
import queue
import select
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Self, TypeVar

from tactileq.modeling.errors import InputError
from tactileq.rig.shared.live.compiled import CLOCK, compiled, is_compiled

SLICE_S = 1e-3

Item = TypeVar("Item")


def now_s() -> float:
    """Seconds on the one clock of all processes of a rig (monotonic, with an arbitrary zero)."""
    return float(compiled().lib.tq_now()) if is_compiled() else time.perf_counter()


def is_given() -> bool:
    """Whether the clock is one that is given from outside, for what is simulated."""
    return is_compiled() and bool(compiled().lib.tq_clock_given())


def sleep(seconds: float) -> None:
    """Wait for so long (s; none below 0)."""
    if is_given():
        compiled().lib.tq_sleep_until(now_s() + max(0.0, seconds))
    else:
        time.sleep(max(0.0, seconds))


def wait_for(wait: Callable[[float], bool], within_s: float) -> bool:
    """What `wait` of an event, a lock or a future returns, called with the longest time to wait."""
    if not is_given():
        return wait(within_s)
    end_s = now_s() + within_s
    while not wait(0):
        if now_s() >= end_s:
            return False
        sleep(SLICE_S)
    return True


def next_of(waiting: queue.Queue[Item], within_s: float) -> tuple[Item, ...]:
    """What comes next in a queue, in a tuple; nothing after this time."""
    taken: list[Item] = []

    def take(longest_s: float) -> bool:
        with suppress(queue.Empty):
            taken.append(waiting.get(timeout=longest_s) if longest_s else waiting.get_nowait())
        return bool(taken)

    wait_for(take, within_s)
    return tuple(taken)


def readable(of: int, within_s: float, *, or_else: int = -1) -> tuple[bool, bool]:
    """Wait until one of two descriptors can be read (−1: none), or the time is over; which can."""
    if is_given():
        found = compiled().lib.tq_wait_readable(of, or_else, now_s() + within_s)
        return bool(found & 1), bool(found & 2)
    both = [one for one in (of, or_else) if one >= 0]
    ready, _, _ = select.select(both, [], [], within_s)
    return of in ready, or_else in ready


@contextmanager
def holding(lock: threading.Lock) -> Iterator[None]:
    """Hold a lock; who waits for it does so by the clock."""
    while not wait_for(lambda seconds: lock.acquire(timeout=seconds), 1.0):
        pass
    try:
        yield
    finally:
        lock.release()


@contextmanager
def taking_part() -> Iterator[None]:
    """A given clock waits for this thread meanwhile, wherever it does not wait for the clock."""
    begins = compiled().lib.tq_take_part(1)
    try:
        yield
    finally:
        if begins:  # else it goes on to, as before
            compiled().lib.tq_take_part(0)


def called(next_s: float) -> None:
    """A given clock waits for this thread, which others call: by this time, or a little later."""
    if is_given():
        compiled().lib.tq_called(next_s)


def check_clock(what: str, *, simulated: bool) -> None:
    """Refuse to run anything but what is simulated by a given clock.

    Raises
    ------
    InputError
        For a real one: a clock that stands still would let it push or play on.
    """
    if is_given() and not simulated:
        raise InputError(
            f"expected the computer's clock for {what}, got the one of {CLOCK}; unset that "
            "variable."
        )


class GivenClock:
    """A clock for this process and those that it starts, while this is open; Linux only.

    It goes as the computer's does, and stands still while anybody who takes part is late. A process
    that goes on afterwards has the computer's clock from the same moment on.
    """

    def __init__(self) -> None:
        self._library = compiled().lib
        folder = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        handle, name = tempfile.mkstemp(prefix="tactileq-clock-", dir=folder)
        self.path = Path(name)
        os.truncate(handle, self._library.tq_clock_size())
        self._memory = mmap.mmap(handle, self._library.tq_clock_size())
        os.close(handle)
        self._buffer = compiled().ffi.from_buffer(self._memory, require_writable=True)
        self._address = compiled().ffi.cast("void *", self._buffer)
        run = self._library.tq_clock_run
        self._thread = threading.Thread(target=run, args=(self._address,), daemon=True)

    @property
    def hung(self) -> str:
        """Who was given up last, after a minute in which all waited for it; empty for nobody."""
        process, thread = divmod(int(self._library.tq_clock_hung(self._address)), 2**32)
        return f"thread {thread} of process {process}" if process else ""

    def __enter__(self) -> Self:
        self._library.tq_clock_start(self._address)
        self._thread.start()
        os.environ[CLOCK] = str(self.path)
        self._library.tq_clock_take(os.fsencode(self.path))
        return self

    def __exit__(self, *_: object) -> None:
        self._library.tq_clock_end(self._address)
        self._thread.join()
        self._library.tq_clock_take(compiled().ffi.NULL)
        os.environ.pop(CLOCK, None)
        self.path.unlink()
