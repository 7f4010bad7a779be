"""The compiled engine of slopes and responses beside NumPy's, and without a compiler."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling.arrays import Floats
from tactileq.modeling.engines import SWITCH
from tactileq.modeling.estimation.coherent import Observed, climb, limits_of, response, slopes
from tactileq.modeling.estimation.compiled import held_by_cells, is_compiled
from tactileq.modeling.estimation.likelihood import Power, bins_near
from tactileq.modeling.fitting.blending import Middles
from tactileq.modeling.fitting.equations import STEP_OF_CORNERS, cells

SOURCE = Path(__file__).with_name("slopes_bits.c")
HEADER = Path(__file__).parents[3] / "modeling" / "estimation" / "slopes.h"
RATE_HZ = 1000.0
Result = TypeVar("Result")
# Seed, rows, layers, bins, whether layers are extreme, and whether they are independent.
CASES = given(
    st.integers(0, 2**32),
    st.integers(1, 6),
    st.integers(0, 12),
    st.integers(1, 90),
    st.booleans(),
    st.booleans(),
)


@pytest.fixture(autouse=True)
def _unswitched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(SWITCH, raising=False)
    assert is_compiled()


def in_numpy(function: Callable[..., Result], *arguments: object) -> Result:
    """What a function returns without the compiled engine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(SWITCH, "1")
        assert not is_compiled()
        return function(*arguments)


def drawn(
    seed: int, *, rows: int, layers: int, bins: int, extreme: bool = False
) -> tuple[Floats, Floats, Observed]:
    """Random parameters (K, p), signs (K, m) and spectra, a fifth of the bins without weight.

    Extreme layers have equal signs: of what is left where e⁵⁰ cancels e⁵⁰ no engine knows digits.
    """
    rng, shape = np.random.default_rng(seed), (rows, layers)
    gains = rng.normal(0, 1.5, shape)
    if extreme:
        gains = np.where(rng.random(shape) < 0.3, rng.choice([-50.0, 50.0], shape), gains)
    theta = np.concatenate(
        (
            rng.choice([-50.0, 50.0], (rows, 1)) if extreme else rng.normal(-1, 1, (rows, 1)),
            np.log(rng.uniform(0.5, 600, shape)),  # places above the Nyquist frequency, too
            rng.uniform(np.log(0.3), np.log(300), shape),
            gains,
        ),
        axis=1,
    )
    tangent = np.tan(np.pi / RATE_HZ * np.sort(rng.uniform(15, 490, (rows, bins)), axis=1))
    weight = rng.uniform(0.5, 40, (rows, bins)) * (rng.random((rows, bins)) > 0.2)
    weight[:, rng.integers(bins + 1) :] = 0.0
    power = rng.exponential(1, (rows, bins)) * (weight > 0)  # without weight there may be no power
    line_hz = rng.choice([0.0, 0.9, 5.0], rows)
    observed = Observed(power, weight, weight, tangent, 1 / tangent, line_hz, RATE_HZ)
    signs = np.ones(shape) if extreme else rng.choice([-1.0, 1.0], shape)
    return theta, signs, observed


def assert_same(found: Floats, expected: Floats, *, beside: Floats | float = 0.0) -> None:
    """To 1e-9 of the largest of each row (and of what the row is a difference of)."""
    assert found.shape == expected.shape
    rows = (len(expected), -1)
    scale = np.abs(expected.reshape(rows)).max(axis=1, initial=0.0) + beside
    off = np.abs(found - expected).reshape(rows).max(axis=1, initial=0.0)
    assert (off <= 1e-9 * scale).all(), (off, scale)


@settings(deadline=None, max_examples=200)
@CASES
def test_slopes_are_those_of_numpy(
    seed: int, rows: int, layers: int, bins: int, extreme: bool, independent: bool
) -> None:
    theta, signs, observed = drawn(seed, rows=rows, layers=layers, bins=bins, extreme=extreme)
    arguments = theta, None if independent else signs, observed
    found, expected = slopes(*arguments), in_numpy(slopes, *arguments)
    beside = observed.weight.sum(axis=1)
    assert_same(found.misfit, expected.misfit, beside=beside)
    assert_same(found.objective, expected.objective, beside=beside)
    assert_same(found.information, expected.information)
    assert_same(found.score, expected.score, beside=beside)


@settings(deadline=None, max_examples=100)
@CASES
def test_responses_are_those_of_numpy(
    seed: int, rows: int, layers: int, bins: int, extreme: bool, independent: bool
) -> None:
    theta, signs, observed = drawn(seed, rows=rows, layers=layers, bins=bins, extreme=extreme)
    arguments = theta, None if independent else signs[0], observed  # one row of signs for all
    found, expected = response(*arguments), in_numpy(response, *arguments)
    assert found.power == pytest.approx(expected.power, rel=1e-9)
    assert_same(found.by_parameter, expected.by_parameter)
    assert_same(found.by_tangent, expected.by_tangent)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_cancelling_layers_cost_the_same(up: float) -> None:
    """Two layers that nearly cancel at their own frequencies, so that both are penalised."""
    _, _, observed = drawn(3, rows=1, layers=2, bins=40)
    theta = np.array([[-3.0, np.log(100), np.log(104), np.log(30), np.log(30), 1.0, 1.0]])
    signs = np.array([[up, -up]])
    found, expected = slopes(theta, signs, observed), in_numpy(slopes, theta, signs, observed)
    assert expected.objective[0] > expected.misfit[0] + 1
    for one, other in zip(found, expected, strict=True):
        assert_same(one, other)


def test_a_power_of_0_in_a_bin_that_counts_is_infinitely_far_from_expected() -> None:
    theta, signs, observed = drawn(5, rows=2, layers=1, bins=30)
    first = int(np.flatnonzero(observed.weight[0])[0])
    observed.power[0, first] = 0.0
    found = slopes(theta, signs, observed)
    assert found.misfit[0] == np.inf
    assert np.isfinite(found.misfit[1])


def test_a_parameter_without_a_value_spoils_its_own_row_alone() -> None:
    theta, signs, observed = drawn(6, rows=3, layers=2, bins=30)
    theta[1, 5] = np.nan
    found, expected = slopes(theta, signs, observed), in_numpy(slopes, theta, signs, observed)
    for one, other in zip(found, expected, strict=True):
        assert np.isnan(one[1]).any()
        assert np.isnan(other[1]).any()
        assert_same(one[::2], other[::2])


def test_bits_of_a_row_do_not_depend_on_its_neighbours_or_on_bins_without_weight() -> None:
    theta, signs, observed = drawn(7, rows=5, layers=3, bins=61)
    together = slopes(theta, signs, observed)
    for row in range(5):
        kept = observed.weight[row] > 0
        one = observed.rows([row])
        last = int(np.flatnonzero(kept)[-1]) + 1
        short = Observed(
            *(table[:, :last] for table in (one.power, one.weight, one.count)),
            *(table[:, :last] for table in (one.tangent, one.cotangent)),
            one.line_hz,
            RATE_HZ,
        )
        alone = slopes(theta[row : row + 1], signs[row : row + 1], short)
        for whole, part in zip(together, alone, strict=True):
            assert whole[row].tobytes() == part[0].tobytes()


def test_a_spectrum_without_weight_says_nothing_about_independent_layers() -> None:
    theta, _, observed = drawn(8, rows=3, layers=2, bins=20)
    hidden = observed.without(np.array([False, True, False]))
    found = slopes(theta, None, hidden)
    for array, seen in zip(found, slopes(theta, None, observed), strict=True):
        assert not np.any(array[1])
        assert array[::2].tobytes() == seen[::2].tobytes()


def test_a_climb_ends_at_the_same_place() -> None:
    theta, signs, observed = drawn(9, rows=4, layers=2, bins=60)
    limits = limits_of(2, rate_hz=RATE_HZ, step_hz=1.0)

    def climbed() -> Floats:
        return climb(theta, signs, observed, limits=limits, steps=10).objective

    assert climbed() == pytest.approx(in_numpy(climbed), rel=1e-6)


@settings(deadline=None)
@given(st.integers(0, 2**32), st.integers(0, 5), st.integers(1, 400), st.floats(1.0, 9.0))
def test_bins_are_those_of_numpy(seed: int, layers: int, lines: int, records: float) -> None:
    rng = np.random.default_rng(seed)
    step_hz = rng.choice([0.5, 1.0, 1.3])
    frequency = 15.0 + step_hz * np.arange(lines)
    weight = rng.random(lines) * (rng.random(lines) > 0.3)
    weight[rng.integers(lines)] = 1.0
    weight[lines // 2 : lines // 2 + rng.integers(lines)] *= rng.integers(2)  # a part unheard
    weight[0] = 1.0
    power = Power(frequency, rng.exponential(1, lines), 1.0, weight, RATE_HZ, step_hz, records)
    peaks = rng.uniform(10, 400, layers), np.exp(rng.uniform(-1, 5, layers))
    found, expected = bins_near(power, *peaks), in_numpy(bins_near, power, *peaks)
    for name in ("power", "weight", "count", "tangent", "cotangent"):
        ours, theirs = getattr(found, name), getattr(expected, name)
        assert ours.shape == theirs.shape
        assert ours == pytest.approx(theirs, rel=1e-12), name


@pytest.mark.parametrize("rows", [2, 3])
@pytest.mark.parametrize("columns", [1, 2, 4])
@pytest.mark.parametrize("layers", [1, 2, 5])
def test_what_holds_middles_is_that_of_numpy(rows: int, columns: int, layers: int) -> None:
    theta, signs, _ = drawn(12, rows=rows * columns, layers=layers, bins=1)
    theta[:, 1 : 1 + layers] = theta[0, 1 : 1 + layers]  # what moves far is not held
    tangent = np.tan(np.pi / RATE_HZ * np.geomspace(15, 480, 30))[None]
    one = np.ones(tangent.shape)
    places = Observed(one, one, one, tangent, 1 / tangent, np.zeros(1), RATE_HZ)
    shares = np.full(4, 0.25) if columns > 1 else np.array([0.5, 0.0, 0.5, 0.0])
    middles = Middles(cells(rows, columns), shares, places, rows * columns)
    found, expected = middles.held(theta, signs[0]), in_numpy(middles.held, theta, signs[0])
    assert expected.cost > 0
    assert found.cost == pytest.approx(expected.cost, rel=1e-9)
    assert_same(found.score[None], expected.score[None])
    for ours, theirs in zip(found.information, expected.information, strict=True):
        assert ours is not None
        assert theirs is not None
        assert_same(ours[None], theirs[None])


def test_what_is_not_off_holds_nothing() -> None:
    """Places of a cell where nothing is off do not count, whatever their slopes."""
    rng = np.random.default_rng(13)
    slope, off = rng.normal(size=(5, 3, 8)), rng.normal(size=(1, 8))
    lowest = rng.integers(-1, 4, (1, 8))
    off[:, 2:5] = 0.0
    table = {"corners": cells(2, 2), "shares": np.full(4, 0.25), "steps": STEP_OF_CORNERS}
    seen = np.r_[0, 1, 5:8]
    whole = held_by_cells(slope, off, lowest, held=2.0, **table)
    part = held_by_cells(slope[..., seen], off[:, seen], lowest[:, seen], held=2.0, **table)
    for one, other in zip(whole, part, strict=True):
        assert np.any(other)
        assert one == pytest.approx(other, rel=1e-12, abs=1e-15)
    assert not any(
        np.any(array) for array in held_by_cells(slope, 0 * off, lowest, held=2.0, **table)
    )


def test_bits_are_equal_with_and_without_wide_vectors(tmp_path: Path) -> None:
    """As on processors that have none."""
    found = []
    for options in ([], ["-DTQ_BASELINE"]):
        program = tmp_path / f"slopes{len(options)}"
        command = ["gcc", "-std=c99", "-O3", "-ffp-contract=off", "-fno-trapping-math", *options]
        command += [f"-I{HEADER.parent}", str(SOURCE), "-o", str(program), "-lm"]
        subprocess.run(command, check=True)
        run = subprocess.run([program], check=True, capture_output=True, text=True)
        found.append(run.stdout)
    assert len(set(found[0].split())) > 1000
    assert found[0] == found[1]


def test_without_a_compiler_numpy_calculates_the_same() -> None:
    """A fresh process in which the extension cannot be imported."""
    program = """
import sys
sys.modules["tactileq.modeling.estimation._slopes"] = None
from tactileq.modeling.estimation.compiled import held_by_cells, is_compiled
from tactileq.modeling.estimation.likelihood import Power, bins_near
from tactileq.modeling.fitting.blending import Middles
from tactileq.modeling.fitting.equations import STEP_OF_CORNERS, cells
from tests.modeling.estimation.test_compiled import drawn, slopes
print(is_compiled(), *slopes(*drawn(11, rows=3, layers=2, bins=50)).objective)
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    compiled, *objective = run.stdout.split()
    assert compiled == "False"
    expected = slopes(*drawn(11, rows=3, layers=2, bins=50)).objective
    assert [float(value) for value in objective] == pytest.approx(expected, rel=1e-9)
