"""Work in several processes, which end with the process that started them, however it ends."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

LOOK_S = 0.1  # how often a worker looks whether its parent is still there


@contextmanager
def working(
    work: Callable[[Item], Result], items: Sequence[Item], *, jobs: int | None
) -> Iterator[Iterator[tuple[int, Result]]]:
    """The work on each item, `jobs` at a time, as they are done: number of the item, and result.

    Processes of their own where there are several items and jobs (as many jobs as cores without a
    number). After an exception in the block no worker goes on.
    """
    if len(items) < 2 or jobs == 1:
        yield enumerate(map(work, items))
        return
    from joblib import Parallel, cpu_count, delayed

    parallel = Parallel(
        n_jobs=min(jobs or cpu_count(), len(items)),
        return_as="generator_unordered",
        initializer=_end_with,
        initargs=(os.getpid(),),
    )
    results = parallel(delayed(_numbered)(work, *numbered) for numbered in enumerate(items))
    try:
        yield results
    finally:
        results.close()


def _numbered(work: Callable[[Item], Result], number: int, item: Item) -> tuple[int, Result]:
    return number, work(item)


def _end_with(parent: int) -> None:
    """Let this worker end at once when its parent does.

    An interrupt from the keyboard, which all processes of a terminal get, is the parent's matter.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)
