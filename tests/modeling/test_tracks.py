"""Peaks of a grid under common names: planted laws, gaps, false peaks, edges."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modeling.grid import Condition
from modeling.peaks import SILENCE, Peaks
from modeling.peq import Floats
from modeling.tracks import find_tracks, foretell, strayed

SPEEDS = np.linspace(50.0, 350.0, 7)
FORCES = np.linspace(0.5, 3.5, 7)
GRID: list[Condition] = [(float(v), float(f)) for v in SPEEDS for f in FORCES]
PLACES = np.log(np.array(GRID))


def peaks(frequencies_hz: list[float], *, evidence: float = 100.0) -> Peaks:
    frequency = np.sort(np.array(frequencies_hz, dtype=float))
    one = np.ones(frequency.size)
    return Peaks(0.05, frequency, np.minimum(40.0, 0.2 * frequency), one, 1.0, evidence * one)


def law(frequency_hz: float, by_speed: float, by_force: float = 0.0) -> Callable[..., float]:
    """Frequency at a condition: frequency_hz at 200 mm/s and 2 N, powers of speed and force."""

    def at(condition: Condition) -> float:
        return float(
            frequency_hz * (condition[0] / 200) ** by_speed * (condition[1] / 2) ** by_force
        )

    return at


def named(found: dict[Condition, Peaks], laws: list[Callable[..., float]]) -> float:
    """Share of conditions and layers under the right name; layers by frequency in the corner."""
    tracks = find_tracks(found)
    by_corner = sorted(laws, key=lambda at: at(max(found, key=lambda c: (c[1], c[0]))))
    assert tracks.chosen.shape == (len(found), len(laws))
    truth = np.array([[at(c) for at in by_corner] for c in found])
    return float(np.mean(np.abs(np.log(tracks.frequencies_hz / truth)) < 0.05))


@pytest.mark.parametrize("by_speed", [0.0, 0.1, 0.3, 0.5, 0.7, 1.0])
def test_laws_of_any_power_are_followed(by_speed: float) -> None:
    laws = [law(60.0, 0.0), law(300.0, by_speed, 0.05), law(1400.0, 0.1, -0.05)]
    found = {c: peaks([at(c) for at in laws]) for c in GRID}
    tracks = find_tracks(found)
    assert named(found, laws) == 1.0
    assert (tracks.chosen == [0, 1, 2]).all()
    assert (tracks.chosen >= 0).all()


def test_crossing_layers_keep_their_names() -> None:
    """A grating's line at v/0.5 mm passes a resonance at 400 Hz; where they meet is one peak."""
    laws = [law(400.0, 0.0), law(400.0, 1.0)]
    found = {}
    for c in GRID:
        low, high = sorted(at(c) for at in laws)
        found[c] = peaks([low] if high < 1.05 * low else [low, high])
    assert named(found, laws) > 0.98


def test_gaps_and_false_peaks_do_no_harm() -> None:
    rng = np.random.default_rng(0)
    laws = [law(80.0, 0.3), law(350.0, 0.1), law(900.0, 0.0)]
    found = {}
    for c in GRID:
        there = [at(c) * np.exp(0.02 * rng.standard_normal()) for at in laws if rng.random() < 0.7]
        false = rng.uniform(20, 2000, rng.integers(0, 2)).tolist()
        found[c] = peaks(there + false)
    tracks = find_tracks(found)
    truth = np.array([[at(c) for at in laws] for c in GRID])
    distance = np.abs(np.log(tracks.frequencies_hz[:, :, None] / truth[:, None, :]))
    by_layer = np.median(distance, axis=0).min(axis=0)
    assert (by_layer < 0.05).all()  # all three are among the layers
    mine = np.argmin(np.median(distance, axis=0), axis=0)
    assert len(set(mine)) == 3
    kept = distance[:, mine, np.arange(3)] < 0.1
    assert kept.mean() > 0.98
    # What only chance supports has less support than the planted ones.
    support = (tracks.chosen >= 0).mean(axis=0)
    assert support[mine].min() > 0.5
    assert np.delete(support, mine).max(initial=0.0) < 0.3


def test_doubtful_peaks_in_few_conditions_are_no_layer() -> None:
    found = {c: peaks([200.0] if i % 4 else [200.0, 700.0]) for i, c in enumerate(GRID)}
    assert find_tracks(found).chosen.shape[1] == 2
    doubtful = {
        c: Peaks(
            p.noise_gain,
            p.frequencies_hz,
            p.bandwidths_hz,
            p.gains,
            p.shape,
            np.where(p.frequencies_hz > 500, 8.0, 100.0),
        )
        for c, p in found.items()
    }
    assert find_tracks(doubtful).chosen.shape[1] == 1


def test_a_layer_that_has_left_the_band_takes_the_peak_at_its_lower_end() -> None:
    low = law(60.0, 1.0)  # 15 Hz at the lowest speed
    laws = [low, law(700.0, 0.0)]
    found = {c: peaks([max(at(c), 16.0) for at in laws]) for c in GRID}
    tracks = find_tracks(found)
    assert tracks.chosen.shape[1] == 2
    assert (tracks.chosen >= 0).all()


def test_silence_has_no_tracks() -> None:
    tracks = find_tracks(dict.fromkeys(GRID, SILENCE))
    assert tracks.chosen.shape == (49, 0)
    assert tracks.chosen.shape[1] == 0
    one = find_tracks({GRID[0]: peaks([100.0, 300.0])})
    assert one.chosen.tolist() == [[0, 1]]


@settings(deadline=None, max_examples=40)
@given(
    st.lists(st.lists(st.floats(16, 2400), max_size=4, unique=True), min_size=1, max_size=12),
    st.floats(3, 100),
)
def test_whatever_peaks_there_are(rows: list[list[float]], evidence: float) -> None:
    """No peak has two names, and where a layer has one its frequency is the peak's."""
    grid = [(50.0 * (1 + i % 4), 1.0 + i // 4) for i in range(len(rows))]
    found = {c: peaks(row, evidence=evidence) for c, row in zip(grid, rows, strict=True)}
    tracks = find_tracks(found)
    for row, chosen in zip(rows, tracks.chosen, strict=True):
        own = chosen[chosen >= 0]
        assert len(set(own.tolist())) == own.size
        assert own.max(initial=-1) < len(row)
    assert np.isfinite(tracks.frequencies_hz).all()
    assert (tracks.frequencies_hz > 0).all()
    has = tracks.chosen >= 0
    where = np.argwhere(has)
    for c, layer in where:
        assert tracks.frequencies_hz[c, layer] == pytest.approx(
            found[grid[c]].frequencies_hz[tracks.chosen[c, layer]]
        )


def test_order_of_coming_does_not_matter() -> None:
    rng = np.random.default_rng(1)
    laws = [law(80.0, 0.3), law(350.0, 1.0), law(900.0, 0.0)]
    found = {c: peaks([at(c) * np.exp(0.02 * rng.standard_normal()) for at in laws]) for c in GRID}
    tracks = find_tracks(found)
    order = rng.permutation(len(GRID))
    again = find_tracks({GRID[i]: found[GRID[i]] for i in order})
    assert again.chosen.tolist() == tracks.chosen[order].tolist()
    assert again.frequencies_hz == pytest.approx(tracks.frequencies_hz[order])


# --- what the others say of a missing one


def table(*laws: Callable[..., float]) -> Floats:
    return np.array([[at(c) for at in laws] for c in GRID])


def test_missing_frequencies_are_foretold_by_the_law() -> None:
    truth = table(law(100.0, 0.4, 0.05), law(800.0, 0.0))
    present = np.random.default_rng(0).random(truth.shape) < 0.6
    widths = np.full(truth.shape, 30.0)
    widths[0] = 300.0  # one that was misread
    given_frequency = np.where(present, truth, 1.0)
    frequency, bandwidth = foretell(PLACES, given_frequency, widths, present=present)
    assert (frequency[present] == truth[present]).all()
    assert frequency == pytest.approx(truth, rel=0.02)
    assert (bandwidth[~present] == 30.0).all()


def test_only_what_lies_off_its_law_has_strayed() -> None:
    rng = np.random.default_rng(0)
    truth = table(law(100.0, 0.4, 0.05), law(800.0, 0.0))
    measured = truth * np.exp(0.01 * rng.standard_normal(truth.shape))
    present = np.ones(truth.shape, dtype=bool)
    assert not strayed(PLACES, measured, present=present).any()
    measured[5, 0] *= 1.4
    measured[30, 1] *= 0.8
    off = np.zeros(truth.shape, dtype=bool)
    off[5, 0] = off[30, 1] = True
    assert strayed(PLACES, measured, present=present).tolist() == off.tolist()
    present[5, 0] = False
    assert not strayed(PLACES, measured, present=present)[5, 0]
