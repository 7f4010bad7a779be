"""Work in several threads: NumPy, the rendering kernel and hashes let go of Python's lock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def usable_cores() -> int:
    """How many cores this process may use."""
    from joblib import cpu_count  # late: slow to load

    cores: int = cpu_count()
    return cores


@contextmanager
def one_linear_algebra_thread() -> Generator[None]:
    """Linear algebra on one thread within, so that no sum depends on the number of cores.

    SciPy is loaded first: what is loaded afterwards would not be limited.
    """
    import scipy.linalg  # noqa: F401  # late: slow to load
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        yield


def in_order(
    work: Callable[[Item], Result], items: Sequence[Item], *, threads: int
) -> Generator[Result]:
    """The work on each item, in the order of the items; with one thread in the caller's.

    Not far ahead of who takes the results, so that few of them are held. An exception comes where
    the result would have come. When the generator is closed, or ends, no thread goes on.
    """
    if threads == 1 or len(items) < 2:
        yield from map(work, items)
        return
    pool = ThreadPoolExecutor(threads)
    begun: deque[Future[Result]] = deque()
    try:
        for item in items:
            begun.append(pool.submit(work, item))
            if len(begun) == 2 * threads:
                yield begun.popleft().result()
        while begun:
            yield begun.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)
