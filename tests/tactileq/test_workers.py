"""Work divided among processes: results in the order of the items, begun before they are asked.

The work is defined within the tests: processes cannot import a test module.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from tactileq.workers import mapping

LONGEST_S = 500.0


def test_results_keep_the_order_of_their_items(tmp_path: Path):
    def first_after_second(number: int) -> tuple[int, int]:
        (tmp_path / str(number)).touch()
        while number == 0 and not (tmp_path / "2").exists():  # the other process has handed 1 in
            time.sleep(0.01)
        return number, os.getpid()

    with mapping(jobs=2) as mapped:
        found = list(mapped(first_after_second, range(4)))
    assert [number for number, _ in found] == [0, 1, 2, 3]
    assert os.getpid() not in {process for _, process in found}


def test_work_goes_on_before_anybody_asks_for_it(tmp_path: Path):
    def leave_a_mark(name: str) -> str:
        (tmp_path / name).touch()
        return name

    with mapping(jobs=2) as mapped:
        results = mapped(leave_a_mark, ["a", "b", "c"])
        end = time.monotonic() + LONGEST_S
        while len(list(tmp_path.iterdir())) < 3 and time.monotonic() < end:
            time.sleep(0.1)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c"]
        assert list(results) == ["a", "b", "c"]


def test_what_goes_wrong_in_a_process_is_told_by_the_one_that_asked():
    def refuse(number: int) -> int:
        if number == 1:
            raise ValueError("expected another number, got 1; give 0.")
        return number

    with pytest.raises(ValueError, match="got 1; give 0"), mapping(jobs=2) as mapped:
        list(mapped(refuse, range(2)))


def test_several_maps_share_the_processes():
    with mapping(jobs=2) as mapped:
        first, second = mapped(abs, range(-6, 0)), mapped(str, range(3))
        assert list(second) == ["0", "1", "2"]
        assert list(first) == [6, 5, 4, 3, 2, 1]


def test_a_relative_path_means_the_same_in_a_worker_that_began_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def write(name: str) -> str:
        Path(name).write_text(name)
        return os.getcwd()

    for folder in (tmp_path / "first", tmp_path / "second"):
        folder.mkdir()
        monkeypatch.chdir(folder)
        with mapping(jobs=2) as mapped:
            results = mapped(write, ["a", "b"])
            monkeypatch.chdir(tmp_path)  # whatever the caller does meanwhile
            assert set(results) == {str(folder)}
    assert sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("?")) == [
        "first/a",
        "first/b",
        "second/a",
        "second/b",
    ]
