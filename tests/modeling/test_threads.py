"""Work in threads: results in order, little ahead of them, and nobody goes on after the end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from tactileq.modeling.threads import in_order

PATIENCE_S = 500.0


@pytest.fixture(autouse=True)
def nobody_goes_on() -> Iterator[None]:
    before = threading.active_count()
    yield
    assert threading.active_count() == before


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_results_come_in_the_order_of_the_items(threads: int) -> None:
    assert list(in_order(lambda n: n * n, range(50), threads=threads)) == [n * n for n in range(50)]
    assert list(in_order(abs, [], threads=threads)) == []


def test_work_is_done_side_by_side() -> None:
    """The first piece waits for the last one, which would never come one after the other."""
    last = threading.Event()

    def work(number: int) -> bool:
        if number == 2:
            last.set()
        return last.wait(PATIENCE_S)

    assert list(in_order(work, range(3), threads=3)) == [True] * 3


def test_one_thread_is_the_callers() -> None:
    who = in_order(lambda _: threading.current_thread(), range(2), threads=1)
    assert list(who) == [threading.current_thread()] * 2


def test_work_stays_little_ahead_and_ends_with_the_generator() -> None:
    """Of a thousand pieces no more are begun than are held, whatever the threads could do."""
    begun: list[int] = []
    results = in_order(begun.append, range(1000), threads=3)
    for taken in range(1, 5):
        next(results)
        assert taken <= len(begun) <= taken + 2 * 3
    results.close()
    assert len(begun) <= 4 + 2 * 3


@pytest.mark.parametrize("threads", [1, 3])
def test_an_exception_comes_where_its_result_would_have(threads: int) -> None:
    begun: list[int] = []

    def work(number: int) -> int:
        begun.append(number)
        if number in (5, 6):
            raise ValueError(str(number))
        return number

    results = in_order(work, range(1000), threads=threads)
    assert [next(results) for _ in range(5)] == list(range(5))
    with pytest.raises(ValueError, match="^5$"):
        next(results)
    assert max(begun) <= 5 + 2 * threads
    with pytest.raises(StopIteration):
        next(results)


def test_linear_algebra_that_is_loaded_late_is_on_one_thread_too() -> None:
    """In a fresh process, where SciPy's own library is not loaded before."""
    source = (
        "from tactileq.modeling.threads import one_linear_algebra_thread\n"
        "with one_linear_algebra_thread():\n"
        "    import scipy.linalg\n"
        "    from threadpoolctl import threadpool_info\n"
        "    print([each['num_threads'] for each in threadpool_info()])\n"
    )
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    found = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, check=True, env=environment
    )
    threads = json.loads(found.stdout)
    assert threads
    assert set(threads) == {1}
