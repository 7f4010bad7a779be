"""Conditions that are asked for next: half-way to neighbours, on lattices and scattered."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tactileq.analysis.textures.between import chessboard, halfway
from tactileq.analysis.textures.wanted import half_way_to_neighbours

SPEEDS, FORCES = (50.0, 150.0, 250.0, 350.0), (0.5, 1.5, 2.5, 3.5)
LATTICE = [(speed, force) for speed in SPEEDS for force in FORCES]
SCATTERED = st.lists(
    st.tuples(st.floats(20, 400), st.floats(0.2, 4)), min_size=1, max_size=12, unique=True
)


@pytest.mark.parametrize(
    ("near", "wanted"),
    [
        ((150.0, 1.5), {(100, 1), (100, 2), (200, 1), (200, 2)}),
        ((150.0, 0.5), {(100, 1), (200, 1)}),
        ((350.0, 3.5), {(300, 3)}),
    ],
)
def test_on_a_lattice_the_middles_of_the_cells_that_adjoin_it(near, wanted) -> None:
    assert set(half_way_to_neighbours([near], LATTICE)) == wanted


def test_near_every_condition_all_middles_are_wanted_once() -> None:
    found = half_way_to_neighbours(LATTICE, LATTICE)
    assert sorted(found) == sorted(halfway(SPEEDS, FORCES))
    assert half_way_to_neighbours([], LATTICE) == []


def test_with_one_force_the_next_speeds_on_either_side() -> None:
    line = [(speed, 1.2) for speed in SPEEDS]
    assert half_way_to_neighbours([(150.0, 1.2)], line) == [(100.0, 1.2), (200.0, 1.2)]
    across = [(90.0, force) for force in FORCES]
    assert half_way_to_neighbours([(90.0, 0.5)], across) == [(90.0, 1.0)]


def test_what_a_hand_cannot_tell_from_a_recorded_condition_is_not_wanted() -> None:
    middles = halfway(SPEEDS, FORCES)
    # 100 mm/s and 1 N are recorded; a quarter further, 125 mm/s and 1.25 N are not.
    found = half_way_to_neighbours([(150.0, 1.5)], LATTICE + middles)
    assert (125.0, 1.25) in found
    assert not set(found) & set(middles)
    near = [(150.0, 1.5), (156.0, 1.6), (300.0, 3.0)]
    assert half_way_to_neighbours([(150.0, 1.5)], near) == [(225.0, 2.25)]
    assert half_way_to_neighbours([(150.0, 1.5)], [(150.0, 1.5), (161.0, 1.6)]) == []


def test_speeds_that_are_all_but_the_same_become_one() -> None:
    recorded = [(100.0, 1.0), (200.0, 2.0), (208.0, 0.5)]
    found = half_way_to_neighbours([(100.0, 1.0)], recorded)
    assert sorted(found) == [(152.0, 0.75), (152.0, 1.5)]


@given(SCATTERED, st.integers(0, 2**31))
@example(
    # Groups anchored at their lowest speed would leave means of 276 and 287 mm/s.
    [(20.0, f) for f in (2.0, 3.0, 1.5, 1.75, 0.5, 0.25, 1.0)]
    + [(196.0, 2.0), (260.0, 2.5), (261.0, 3.0), (313.0, 2.0), (366.0, 1.0)],
    7681,
)
def test_scattered_conditions_stay_within_the_recorded_range(recorded, seed) -> None:
    near = [recorded[place] for place in np.random.default_rng(seed).permutation(len(recorded))[:3]]
    found = np.array(half_way_to_neighbours(near, recorded)).reshape(-1, 2)
    assert len(found) <= 4 * len(near)
    low, high = np.min(recorded, axis=0), np.max(recorded, axis=0)
    assert (found >= low * (1 - 1e-12)).all()
    assert (found <= high * (1 + 1e-12)).all()
    for speed, force in found:
        assert all(abs(speed / v - 1) >= 0.05 or abs(force / f - 1) >= 0.1 for v, f in recorded)
    for axis in found.T:
        steps = np.unique(axis)
        assert (steps[1:] >= 1.1 * steps[:-1]).all()


def test_a_lattice_with_middles_is_left_out_by_halves() -> None:
    """By rows and columns its nodes and middles would all have one colour."""
    every = set(LATTICE) | set(halfway(SPEEDS, FORCES))
    sizes = [len(chessboard(every, colour=colour)) for colour in (0, 1)]
    assert sum(sizes) == len(every) - 4
    assert min(sizes) >= 8
    board = {(v, f) for v, f in LATTICE if (SPEEDS.index(v) + FORCES.index(f)) % 2}
    assert chessboard(set(LATTICE), colour=1) == board - {(50.0, 3.5), (350.0, 0.5)}
