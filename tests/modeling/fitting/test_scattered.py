"""Conditions that nobody planned: scattered ones, outliers, blends that collapse, spare layers."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tactileq.modeling import GridError, RecordingSet, TextureModel, fit_texture
from tactileq.modeling.arrays import Floats
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.fitting.joint_grid import LARGEST_DEFECT_DB
from tactileq.modeling.fitting.texture_grid import texture_grid
from tactileq.modeling.models.grid import Condition
from tactileq.stimuli.planted.drawn import FORCES_N, SPEEDS_MM_S, DrawnSurface, draw_surface

FREQUENCY_HZ = np.arange(15.0, 481.0)
# Surfaces by which no constant of the estimator was chosen.
SCATTERED, COLLAPSING = (9001, 9002, 9003), 5046


def records_at(surface: DrawnSurface, conditions: Sequence[Condition], seed: int) -> RecordingSet:
    return RecordingSet(
        record
        for number, (speed, force) in enumerate(conditions)
        for record in surface.record([speed], [force], seed=1000 * seed + number)
    )


def random_conditions(count: int, seed: int) -> list[Condition]:
    rng = np.random.default_rng(seed)
    speeds = np.exp(rng.uniform(np.log(50.0), np.log(350.0), count))
    forces = np.exp(rng.uniform(np.log(0.5), np.log(3.5), count))
    return list(zip(speeds.tolist(), forces.tolist(), strict=True))


def distance_db(model: TextureModel, surface: DrawnSurface, places: Sequence[Condition]) -> float:
    off = [
        20
        * np.log10(
            model.peq(*place).response(FREQUENCY_HZ)
            / surface.magnitude(FREQUENCY_HZ, speed_mm_s=place[0], force_n=place[1])
        )
        for place in places
    ]
    return float(np.sqrt(np.mean(np.square(off))))


@pytest.mark.parametrize("seed", SCATTERED)
def test_hidden_conditions_among_scattered_ones(seed: int) -> None:
    """Nearer than the mean of the recorded conditions' own true spectra, nearest ones first.

    Spectra that are known without error, weighted by the inverse of their distance in log speed
    and log force, are better than what anybody can record.
    """
    surface, conditions = draw_surface(seed), random_conditions(33, seed)
    hidden, recorded = conditions[:5], conditions[5:]
    model = fit_texture(records_at(surface, recorded, seed))
    assert model.noise_gains.size <= 49

    def weighted(place: Condition) -> Floats:
        away = np.linalg.norm(np.log(np.array(recorded)) - np.log(np.array(place)), axis=1)
        logs = [
            np.log(surface.magnitude(FREQUENCY_HZ, speed_mm_s=v, force_n=f)) for v, f in recorded
        ]
        return np.exp(np.average(logs, axis=0, weights=1 / away))

    off = [
        20
        * np.log10(
            weighted(place) / surface.magnitude(FREQUENCY_HZ, speed_mm_s=place[0], force_n=place[1])
        )
        for place in hidden
    ]
    assert distance_db(model, surface, hidden) < np.sqrt(np.mean(np.square(off)))
    assert model.fit is not None
    assert "28 scattered conditions" in " ".join(model.fit.warnings)


def test_speeds_as_measured_share_their_nodes() -> None:
    """Four speeds, each record off by up to 2 %: 4 × 7 nodes, not 28 × 7."""
    rng = np.random.default_rng(4)
    conditions = [
        (float(v * rng.uniform(0.98, 1.02)), float(f))
        for v in (60, 110, 200, 330)
        for f in FORCES_N
    ]
    surface = draw_surface(9010)
    model = fit_texture(records_at(surface, conditions, 1))
    assert model.gains.shape[:2] == (4, 7)
    assert model.speeds_mm_s == pytest.approx([60, 110, 200, 330], rel=0.02)
    assert not model.interpolated.any()
    exact = fit_texture(surface.record((60, 110, 200, 330), FORCES_N, seed=2))
    places = [(85.0, 1.2), (150.0, 2.2), (260.0, 3.2)]
    assert distance_db(model, surface, places) < distance_db(exact, surface, places) + 0.5


def test_a_lattice_keeps_its_conditions() -> None:
    grid = texture_grid(
        {r.condition: s for r, s in recording_spectra(draw_surface(9011).record(seed=3))}
    )
    assert grid.scattered is None
    assert grid.corners.are_nodes
    assert grid.level_sd is None


def test_an_outlier_is_named_and_bends_nothing() -> None:
    """One record 20 dB up, as if by a switch of the gain."""
    surface = draw_surface(9012)
    records = surface.record(seed=5).recordings
    loud = [
        replace(r, samples=10 * r.samples) if r.condition == (200.0, 2.0) else r for r in records
    ]
    model, clean = fit_texture(RecordingSet(loud)), fit_texture(records)
    assert model.fit is not None
    assert clean.fit is not None
    (warning,) = model.fit.warnings
    assert "200 mm/s" in warning
    assert "2 N" in warning
    assert "louder" in warning
    assert not clean.fit.warnings
    others = [(v, f) for v in SPEEDS_MM_S for f in FORCES_N if (v, f) != (200.0, 2.0)]
    assert distance_db(model, surface, others) < distance_db(clean, surface, others) + 0.1
    assert distance_db(model, surface, [(200.0, 2.0)]) < 6.0


def test_blends_hold_where_they_once_collapsed() -> None:
    """A surface whose layers used to cancel between conditions: 4.2 dB off, 17 at single places."""
    surface = draw_surface(COLLAPSING)
    model = fit_texture(surface.record(seed=COLLAPSING))
    middles = [
        ((a + b) / 2, (c + d) / 2)
        for a, b in itertools.pairwise(SPEEDS_MM_S)
        for c, d in itertools.pairwise(FORCES_N)
    ]
    assert distance_db(model, surface, middles) < 0.6
    assert max(distance_db(model, surface, [place]) for place in middles) < 1.5
    assert model.fit is not None
    assert 0 < model.fit.blend_defect_db <= LARGEST_DEFECT_DB


@pytest.mark.long("a sweep of surfaces")
def test_the_expected_distance_is_that_from_the_truth() -> None:
    """On average over surfaces, and longer records bring a model nearer."""
    ratios, lengths = [], []
    nodes = [(v, f) for v in SPEEDS_MM_S for f in FORCES_N]
    for seed in range(9020, 9025):
        surface = draw_surface(seed)
        expected = []
        for duration_s in (1.0, 4.0):
            model = fit_texture(surface.record(duration_s=duration_s, seed=seed))
            assert model.fit is not None
            expected.append(model.fit.distance_db)
            ratios.append(model.fit.distance_db / distance_db(model, surface, nodes))
        lengths.append(expected[1] / expected[0])
    assert 0.9 < np.median(ratios) < 1.5
    assert np.median(lengths) < 0.9


def test_conditions_along_a_line_are_refused() -> None:
    """A hull of hardly any area: the faster, the stronger, and nothing else."""
    along = np.geomspace(1.0, 6.0, 25)
    rng = np.random.default_rng(6)
    conditions = [(float(50 * a), float(0.5 * a * rng.uniform(0.998, 1.002))) for a in along]
    with pytest.raises(GridError, match="on one line"):
        fit_texture(records_at(draw_surface(9030), conditions, 7))


def test_conditions_that_all_coincide_are_refused() -> None:
    rng = np.random.default_rng(8)
    conditions = [
        (float(100 * rng.uniform(0.999, 1.001)), float(rng.uniform(0.999, 1.001)))
        for _ in range(12)
    ]
    with pytest.raises(GridError, match="12 conditions within 1%"):
        fit_texture(records_at(draw_surface(9031), conditions, 8))
