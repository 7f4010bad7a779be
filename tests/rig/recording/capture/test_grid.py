"""Cells of a grid: which hands are in them, and files that hold one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.rig.recording.capture.exploration import grid_text
from tactileq.rig.recording.capture.grid import NOWHERE, StrokeGrid
from tests.refusals import refused

# Steps of a grid are apart by more than rounding.
AXES = st.lists(st.integers(1, 10_000), min_size=1, max_size=8, unique=True).map(
    lambda tenths: [0.1 * value for value in sorted(tenths)]
)


def test_cells_of_the_default_grid_by_hand() -> None:
    grid = StrokeGrid.default()
    assert grid.shape == (7, 7)
    hands = {
        (50, 0.5): 0,
        (-54.9, 0.59): 0,  # either direction
        (55.1, 0.5): NOWHERE,
        (44.9, 0.5): NOWHERE,
        (100, 0.61): NOWHERE,
        (350, 3.5): 48,
        (326, 3.5): 48,  # half-way to 300 at most
        (324, 3.5): 41,
        (374, 3.74): 48,
        (np.nan, 1): NOWHERE,
        (100, np.nan): NOWHERE,
        (0, 0): NOWHERE,
    }
    speeds, forces = zip(*hands, strict=True)
    assert grid.cells(speeds, forces).tolist() == list(hands.values())


@given(AXES, AXES, st.floats(0.01, 0.5), st.floats(0.01, 0.5), st.integers(0, 2**31))
def test_a_hand_is_in_the_cell_of_the_nearest_condition_or_in_none(
    speeds, forces, speed_tolerance, force_tolerance, seed
) -> None:
    grid = StrokeGrid(speeds, forces, speed_tolerance, force_tolerance)
    rng = np.random.default_rng(seed)
    v = np.append(rng.uniform(0, 1.6 * speeds[-1], 200), speeds[0])
    f = np.append(rng.uniform(0, 1.6 * forces[-1], 200), forces[0])
    cells = grid.cells(v, f)
    assert cells[-1] == 0
    for cell, speed, force in zip(cells, v, f, strict=True):
        near = [
            axis[np.abs(axis - value).argmin()]
            for axis, value in ((grid.speeds_mm_s, speed), (grid.forces_n, force))
        ]
        apart = abs(speed / near[0] - 1), abs(force / near[1] - 1)
        if cell != NOWHERE:
            held = grid.conditions[cell]
            # At equal distance to two conditions either is right.
            assert abs(held[0] - speed) <= abs(near[0] - speed) * (1 + 1e-9)
            assert abs(held[1] - force) <= abs(near[1] - force) * (1 + 1e-9)
            assert apart[0] <= speed_tolerance * (1 + 1e-9)
            assert apart[1] <= force_tolerance * (1 + 1e-9)
        else:
            inside = apart[0] < speed_tolerance * 0.999 and apart[1] < force_tolerance * 0.999
            between = any(
                axis.size > 1 and np.partition(np.abs(axis - value), 1)[1] <= abs(n - value) * 1.001
                for axis, value, n in (
                    (grid.speeds_mm_s, speed, near[0]),
                    (grid.forces_n, force, near[1]),
                )
            )
            assert not inside or between


def test_a_file_gives_the_grid_and_its_tolerances(tmp_path: Path) -> None:
    file = tmp_path / "grid.toml"
    file.write_text("speeds_mm_s = [60, 120.5]\nforces_n = [1]\nforce_tolerance = 0.3\n")
    grid = StrokeGrid.load(file)
    assert grid.conditions == [(60.0, 1.0), (120.5, 1.0)]
    assert (grid.speed_tolerance, grid.force_tolerance) == (0.1, 0.3)


def test_only_wanted_conditions_have_a_cell_and_a_file_keeps_them(tmp_path: Path) -> None:
    file = tmp_path / "grid.toml"
    file.write_text(
        "speeds_mm_s = [60, 120]\nforces_n = [1, 2, 3]\n"
        "conditions = [[120, 1], [60, 2], [120, 3]]\n"
    )
    grid = StrokeGrid.load(file)
    assert grid.conditions == [(60.0, 2.0), (120.0, 1.0), (120.0, 3.0)]
    assert grid.wanted.tolist() == [[False, True, False], [True, False, True]]
    assert grid.cells([60, 60, 120, 121, 120, 90], [1, 2, 1, 2, 3, 2]).tolist() == [
        *(NOWHERE, 0, 1, NOWHERE, 2, NOWHERE)
    ]
    file.write_text(grid_text(grid))
    assert StrokeGrid.load(file).to_dict() == grid.to_dict()
    assert grid.to_dict()["conditions"] == [[60.0, 2.0], [120.0, 1.0], [120.0, 3.0]]
    assert "conditions" not in StrokeGrid.default().to_dict()


@pytest.mark.parametrize(
    ("conditions", "expected", "got"),
    [
        ("[[60, 2]]", ["each once", "of the grid"], "(60.0, 2.0)"),
        ("[[60, 1], [60, 1]]", ["each once", "of the grid"], "(60.0, 1.0)"),
        ("[]", ["pairs", "conditions"], "[]"),
        ("[60, 1]", ["pairs", "conditions"], "[60, 1]"),
        ("[[60, 1, 1]]", ["pairs", "conditions"], "[[60, 1, 1]]"),
        ('[["fast", 1]]', ["pairs", "conditions"], "fast"),
        ("3", ["pairs", "conditions"], 3),
    ],
)
def test_conditions_that_are_not_of_the_grid_are_refused(
    tmp_path: Path, conditions: str, expected: list[str], got: object
) -> None:
    file = tmp_path / "grid.toml"
    file.write_text(f"speeds_mm_s = [60, 120]\nforces_n = [1]\nconditions = {conditions}\n")
    with refused(InputError, names=file, expected=expected, got=got):
        StrokeGrid.load(file)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("forces_n = [1]", "expected a list of numbers speeds_mm_s in .*, got None; make the"),
        ('speeds_mm_s = ["fast"]\nforces_n = [1]', "expected a list of numbers speeds_mm_s"),
        ("speeds_mm_s = [2, 1]\nforces_n = [1]", "grid.toml: expected one or more rising values"),
        ("speeds_mm_s = []\nforces_n = [1]", "expected one or more rising values above 0 in speed"),
        ("speeds_mm_s = [0.0, 1]\nforces_n = [1]", "rising values above 0 in speeds_mm_s"),
        ("speeds_mm_s = [nan]\nforces_n = [1]", "expected one or more rising values above 0"),
        ("speeds_mm_s = [1e9]\nforces_n = [1]", "1 to 50 values of at most 100000 in speeds_mm_s"),
        ("speeds_mm_s = [1]\nforces_n = [1]\nspeed_tolerance = 0.9", "from 0.01 to 0.5 for speed"),
        ("speeds_mm_s = [1]\nforces_n = [1]\nspeed = 1", "expected only speeds_mm_s, forces_n"),
    ],
)
def test_a_file_that_is_no_grid_is_refused_in_one_sentence(
    tmp_path: Path, text: str, sentence: str
) -> None:
    file = tmp_path / "grid.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=sentence):
        StrokeGrid.load(file)
