"""Work in several processes, which end with the process that started them, however it ends."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from typing import Any, TypeVar

from tactileq.modeling.errors import shown

Item = TypeVar("Item")
Result = TypeVar("Result")

ANSWER_S = 5.0  # within which a scheduler must answer
LOOK_S = 0.1  # how often a worker looks whether its parent is still there


@contextmanager
def working(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    jobs: int | None,
    dask: str | None = None,
) -> Iterator[Iterator[tuple[int, Result]]]:
    """The work on each item, `jobs` at a time, as they are done: number of the item, and result.

    Processes of their own where there are several items and jobs (as many jobs as cores without a
    number), in the folder that this process is in now: a relative path means there what it means
    here. After an exception in the block no worker continues. With the address of a Dask scheduler
    its workers do the same work instead, in folders of their own.

    Raises
    ------
    ValueError
        If Dask is not installed, or nobody answers at its address.
    """
    if dask is None and (len(items) < 2 or jobs == 1):
        yield enumerate(map(work, items))
        return
    from joblib import Parallel, cpu_count, delayed

    with _dask(dask) if dask else nullcontext():
        most = len(items) if dask else min(jobs or cpu_count(), len(items))
        ending: dict[str, Any] = (
            {} if dask else {"initializer": _end_with, "initargs": (os.getpid(),)}
        )
        # Joblib's processes are those of an earlier call, and may have begun in another folder.
        folder = None if dask else os.getcwd()
        parallel = Parallel(n_jobs=most, return_as="generator_unordered", **ending)
        results = parallel(delayed(_numbered)(work, folder, *of) for of in enumerate(items))
        try:
            yield results
        finally:
            results.close()


@contextmanager
def _dask(address: str) -> Iterator[None]:
    """Joblib's work goes to this Dask scheduler."""
    try:
        from distributed import Client
    except ImportError as error:
        raise ValueError(
            "expected Dask for --dask, got none installed; install it with "
            "pip install 'tactileq[dask]'."
        ) from error
    from joblib import parallel_config

    try:
        client = Client(address, timeout=ANSWER_S)
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise ValueError(
            f"expected a Dask scheduler at {shown(address)}, got no answer; start one with dask "
            "scheduler, and give the address that it prints."
        ) from error
    with client, parallel_config(backend="dask"):
        yield


@contextmanager
def mapping(*, jobs: int | None) -> Iterator[Callable[..., Iterator[Any]]]:
    """As `map`, but with the work done by several processes, which begin at once.

    Iterating over the results waits for them; after the block no worker continues.
    """
    with ExitStack() as stack:

        def mapped(work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
            return _in_order(stack.enter_context(working(work, items, jobs=jobs)))

        yield mapped


def _in_order(results: Iterator[tuple[int, Result]]) -> Iterator[Result]:
    """Numbered results by their numbers, each as soon as those before it are there."""
    early: dict[int, Result] = {}
    wanted = 0
    for number, result in results:
        early[number] = result
        while wanted in early:
            yield early.pop(wanted)
            wanted += 1


def _numbered(
    work: Callable[[Item], Result], folder: str | None, number: int, item: Item
) -> tuple[int, Result]:
    if folder is not None:
        os.chdir(folder)
    return number, work(item)


def _end_with(parent: int) -> None:
    """Let this worker end at once when its parent does.

    The parent handles keyboard interrupts, which all processes of a terminal receive.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    collect_less_often()
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def collect_less_often() -> None:
    """Look for garbage less often: the libraries, once loaded, are a million objects to look at.

    At the process's end not at all, which would take a second.
    """
    gc.set_threshold(100_000, 20, 20)
    atexit.register(gc.freeze)


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)
