"""The bugs of tools/plant_bugs can still be planted; make plant tells whether tests notice them."""

from __future__ import annotations

import importlib.util
import subprocess
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parent.parent
PATCHES = sorted((ROOT / "tools" / "plant_bugs").glob("*.patch"))
ROOMS = {"modeling", "stimuli", "rig", "experiments", "analysis", "benches", "tactileq"}


@pytest.fixture(scope="module")
def plant() -> ModuleType:
    spec = importlib.util.spec_from_file_location("plant", ROOT / "tools/plant_bugs/plant.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("patch", PATCHES, ids=lambda patch: patch.stem)
def test_each_bug_can_still_be_planted(patch: Path) -> None:
    checked = subprocess.run(
        ["git", "apply", "--check", str(patch)], cwd=ROOT, capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stderr


def test_there_are_forty_of_all_rooms_each_named_after_its_own_and_described(
    plant: ModuleType,
) -> None:
    bugs = plant.all_bugs()
    assert len(bugs) >= 40
    assert {bug.room for bug in bugs} == ROOMS
    for bug in bugs:
        assert bug.name.startswith(f"{bug.room}-")
        assert len(bug.patch.read_text("utf-8").split("\n---")[0].split()) > 10


def test_the_tests_of_a_bug_are_those_of_its_module_then_of_what_is_around_it(
    plant: ModuleType,
) -> None:
    (bug,) = (one for one in plant.all_bugs() if one.name == "benches-atlas-edge-on-wrong-side")
    places = [place.relative_to(ROOT).as_posix() for place in bug.tests(ROOT)]
    assert places == [
        "tests/benches/atlas/test_edges.py",
        "tests/benches/atlas",
        "tests/benches",
    ]


def test_a_bug_is_caught_by_a_test_that_it_alone_breaks(
    plant: ModuleType,
) -> None:
    """Of three tests one fails with and without the bug, one by chance, one because of it."""
    bug = plant.all_bugs()[0]
    copy = _Copy({"always": [True] * 9, "by chance": [True, False], "by the bug": None})
    assert plant.caught_by(bug, copy) == "by the bug"
    copy = _Copy({"always": [True] * 9})
    assert plant.caught_by(bug, copy) == ""


class _Copy:
    """A copy whose tests fail in turn as said, or where a bug is planted (None)."""

    folder = ROOT

    def __init__(self, fails: dict[str, list[bool] | None]) -> None:
        self._fails, self._planted = fails, False

    def plant(self, bug: object, *, take_out: bool = False) -> None:
        assert self._planted is take_out
        self._planted = not take_out

    def first_failure(self, place: str | Path, *, without: list[str | Path]) -> str:
        tests = [place] if isinstance(place, str) else [t for t in self._fails if t not in without]
        return next((test for test in tests if self._failed(test)), "")

    def _failed(self, test: str) -> bool:
        turns = self._fails[test]
        return self._planted if turns is None else turns.pop(0)
