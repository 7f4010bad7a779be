"""Damping and mass from motion, planted in simulated tools."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.rig.desk.calibration.damping import (
    SOFT_N_PER_MM,
    Bounded,
    Damping,
    Run,
    damping_of,
    soft_wall_n_per_mm,
)
from tests.refusals import refused
from tests.rig.desk.calibration.simulated_motion import PERIOD_S, Tools, moved

CLEAN, DRY = 8, 3  # devices; after them those that are refused
DRY_N = 0.005
STICKS, SHAKEN, BORNE = range(CLEAN + DRY, CLEAN + DRY + 3)


def drawn(count: int, *, seed: int, **more: Floats) -> Tools:
    """Devices of 0.05 to 0.5 kg and 0.5 to 5 N·s/m."""
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.05, 0.5, count)
    return Tools(mass_kg=mass, damping_n_s_per_m=0.5 * 10 ** rng.uniform(0, 1, count), **more)


def of_each(value: float, *places: int) -> Floats:
    """0, but this value at these places."""
    values = np.zeros(BORNE + 1)
    values[list(places)] = value
    return values


@pytest.fixture(scope="module")
def tools() -> Tools:
    dry_n = of_each(DRY_N, *range(CLEAN, CLEAN + DRY)) + of_each(0.1, STICKS)
    beside, noise_n = of_each(0.1, BORNE), of_each(1.0, SHAKEN)
    return drawn(BORNE + 1, seed=3, dry_n=dry_n, noise_n=noise_n, beside_n_per_mm=beside)


@pytest.fixture(scope="module")
def runs(tools: Tools) -> list[list[Run]]:
    return moved(tools, peak_n=0.2, seed=1)


def found_in(runs: list[Run]) -> Damping:
    return damping_of(runs, stiffness_n_per_mm=SOFT_N_PER_MM, period_s=PERIOD_S)


def check_covered(found: list[Damping], tools: Tools, *, share: float) -> None:
    """Values are right, and so many of the intervals, and of the bounds that are written."""
    damping, mass = tools.damping_n_s_per_m[: len(found)], tools.mass_kg[: len(found)]
    check_estimates([one.damping_n_s_per_m for one in found], damping, share=share)
    check_estimates([one.mass_kg for one in found], mass, share=share)
    least = np.array([one.least_damping_n_s_per_m for one in found])
    assert np.mean(least <= damping) >= share
    assert least == pytest.approx(damping, rel=0.2)  # and not far below
    late_ms = 1e3 * PERIOD_S
    assert np.mean([one.delay_ms.low <= late_ms <= one.delay_ms.high for one in found]) >= share


def check_estimates(found: list[Bounded], truths: Floats, *, share: float) -> None:
    values = np.array([one.value for one in found])
    assert values == pytest.approx(truths, rel=0.1)
    assert np.mean(np.abs(values - truths) <= [one.half for one in found]) >= share


def test_planted_damping_mass_and_delay_are_found_within_their_bounds(
    tools: Tools, runs: list[list[Run]]
) -> None:
    found = [found_in(each) for each in runs[:CLEAN]]
    check_covered(found, tools, share=0.75)  # two of eight may lie outside


@pytest.mark.long("sweeps: two hundred devices")
def test_intervals_hold_as_often_as_they_say() -> None:
    tools = drawn(200, seed=4)
    found = [found_in(each) for each in moved(tools, peak_n=0.1, seed=2)]
    check_covered(found, tools, share=0.92)


def test_dry_friction_is_told_from_damping(tools: Tools, runs: list[list[Run]]) -> None:
    """Under one force alone it would be taken for damping."""
    for place in range(CLEAN, CLEAN + DRY):
        found, damping = found_in(runs[place]), tools.damping_n_s_per_m[place]
        assert found.dry_n.low > 0
        assert found.dry_n.value == pytest.approx(DRY_N, rel=0.5)
        assert found.least_damping_n_s_per_m <= damping
        assert found.damping_n_s_per_m.value == pytest.approx(damping, rel=0.2)


@pytest.mark.parametrize(
    ("place", "expected", "got"),
    [(STICKS, "90%", ()), (SHAKEN, "90%", ()), (BORNE, SOFT_N_PER_MM, 0.2)],
    ids=["dry friction", "shaken", "another surface"],
)
def test_what_does_not_follow_from_mass_damping_and_wall_is_refused(
    place: int, expected: object, got: object, runs: list[list[Run]]
) -> None:
    with refused(InputError, expected=expected, got=got):
        found_in(runs[place])


def test_the_wall_is_as_soft_as_the_device_needs() -> None:
    assert soft_wall_n_per_mm(0.3333) == SOFT_N_PER_MM
    assert soft_wall_n_per_mm(0.05) == 0.05
    with refused(InputError, expected=0.02, got=0):
        soft_wall_n_per_mm(-1.0)


def test_a_bound_is_written_with_the_digits_that_it_has() -> None:
    assert str(Bounded(value=2.0132, half=0.022)) == "2.013 (95 % 1.991 to 2.035)"
    assert str(Bounded(value=12.0, half=3.0)) == "12.0 (95 % 9.0 to 15.0)"
