"""Work divided among processes: results in the order of the items, begun before they are asked."""

from __future__ import annotations

import os
import time
from functools import partial
from pathlib import Path

import pytest

from tactileq.workers import mapping


def slow_first(number: int) -> tuple[int, int]:
    """The first item is done last."""
    time.sleep(0.5 * (number == 0))
    return number, os.getpid()


def leave_a_mark(name: str, folder: Path) -> str:
    (folder / name).touch()
    return name


def refuse(number: int) -> int:
    if number == 1:
        raise ValueError("expected another number, got 1; give 0.")
    return number


def test_results_keep_the_order_of_their_items():
    with mapping(jobs=2) as mapped:
        found = list(mapped(slow_first, range(4)))
    assert [number for number, _ in found] == [0, 1, 2, 3]
    assert os.getpid() not in {process for _, process in found}


def test_work_goes_on_before_anybody_asks_for_it(tmp_path):
    with mapping(jobs=2) as mapped:
        results = mapped(partial(leave_a_mark, folder=tmp_path), ["a", "b", "c"])
        for _ in range(600):
            if len(list(tmp_path.iterdir())) == 3:
                break
            time.sleep(0.1)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c"]
        assert list(results) == ["a", "b", "c"]


def test_what_goes_wrong_in_a_process_is_told_by_the_one_that_asked():
    with pytest.raises(ValueError, match="got 1; give 0"), mapping(jobs=2) as mapped:
        list(mapped(refuse, range(2)))
