"""Random surfaces against the statistics they are drawn from, and what joint makes of them."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tactileq.stimuli.planted
from tactileq.analysis.textures.between import halfway, truth_summary
from tactileq.modeling import InputError, fit_ar, fit_texture
from tactileq.modeling.recordings.spectrum import spectrum
from tactileq.stimuli.planted.drawn import (
    FORCES_N,
    RATE_HZ,
    SPEEDS_MM_S,
    alter_surface,
    draw_surface,
)
from tests.refusals import refused

FREQUENCY_HZ = np.arange(15.0, 481.0)
TABLES = Path(tactileq.stimuli.planted.__file__).parent / "spectral_statistics"


def table(name: str) -> tuple[list[str], np.ndarray]:
    with (TABLES / f"{name}.tsv").open(encoding="utf-8") as file:
        header, *rows = csv.reader(file, delimiter="\t")
    return header, np.array([[float(cell) for cell in row[-len(header) + 1 :]] for row in rows])


def test_scores_are_the_polynomial_of_the_tables() -> None:
    """At a node, from the coefficients as drawn; the covariance of many draws is the table's."""
    header, values = table("coefficients")
    assert header[1] == "mean"
    mean, covariance = values[:, 0], values[:, 1:]
    drawn_coefficients = np.array([draw_surface(s).coefficients.ravel() for s in range(2000)])
    scale = np.sqrt(np.diag(covariance))
    assert (drawn_coefficients.mean(axis=0) - mean) / scale == pytest.approx(0, abs=0.1)
    correlation = np.cov(drawn_coefficients.T) / np.outer(scale, scale)
    assert correlation == pytest.approx(covariance / np.outer(scale, scale), abs=0.12)
    surface = draw_surface(3)
    a, b = np.log(350.0 / 150.0), np.log(0.5 / 1.5)
    terms = np.array([1, a, b, a * b, a * a, b * b])
    expected = terms @ surface.coefficients + surface.residuals[6, 0]
    assert surface.scores(350.0, 0.5) == pytest.approx(expected, rel=1e-12)


def test_the_magnitude_is_the_sum_of_the_curves() -> None:
    _, values = table("curves")
    surface = draw_surface(0)
    with (TABLES / "curves.tsv").open(encoding="utf-8") as file:
        rows = [[float(cell) for cell in row] for row in list(csv.reader(file, delimiter="\t"))[1:]]
    frequency = np.array([row[0] for row in rows])
    level_db = values[:, 0] + values[:, 1:] @ surface.scores(120.0, 2.2)
    expected = 10 ** (level_db / 20)
    found = surface.magnitude(frequency, speed_mm_s=120.0, force_n=2.2)
    assert found == pytest.approx(expected, rel=1e-12)
    outside = surface.magnitude([0.0, 499.0], speed_mm_s=120.0, force_n=2.2)
    assert outside == pytest.approx(expected[[0, -1]], rel=1e-12)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 5), st.integers(0, 5), st.floats(0, 1), st.floats(0, 1))
def test_residuals_are_bilinear_between_nodes(i: int, j: int, x: float, y: float) -> None:
    surface = draw_surface(1)
    speed = SPEEDS_MM_S[i] + x * (SPEEDS_MM_S[i + 1] - SPEEDS_MM_S[i])
    force = FORCES_N[j] + y * (FORCES_N[j + 1] - FORCES_N[j])
    a, b = np.log(speed / 150.0), np.log(force / 1.5)
    smooth = np.array([1, a, b, a * b, a * a, b * b]) @ surface.coefficients
    corners = surface.residuals[i : i + 2, j : j + 2]
    weights = np.outer([1 - x, x], [1 - y, y])
    expected = np.tensordot(weights, corners, axes=([0, 1], [0, 1]))
    assert surface.scores(speed, force) - smooth == pytest.approx(expected, abs=1e-9)


def test_records_have_the_magnitude_of_their_condition() -> None:
    """The mean spectrum of 60 records of a second, in bands of 20 Hz, to half a dB."""
    surface = draw_surface(2)
    measured = np.mean(
        [
            spectrum(record).without_leakage ** 2
            for seed in range(60)
            for record in surface.record([200.0], [2.0], seed=seed)
        ],
        axis=0,
    )
    frequency = np.arange(measured.size)
    truth = surface.magnitude(frequency, speed_mm_s=200.0, force_n=2.0) ** 2 * 4 / np.pi
    bands = [slice(f, f + 20) for f in range(20, 480, 20)]
    ratio_db = [10 * np.log10(measured[b].sum() / truth[b].sum()) for b in bands]
    assert ratio_db == pytest.approx([0.0] * len(bands), abs=0.5)


def test_records_are_simulated_and_reproducible() -> None:
    surface = draw_surface(4)
    [one], [again], [other] = (surface.record([50.0], [0.5], seed=s) for s in (0, 0, 1))
    assert one.simulated
    assert (one.rate_hz, one.samples.size, one.unit) == (RATE_HZ, 1000, "g")
    assert np.array_equal(one.samples, again.samples)
    assert not np.array_equal(one.samples, other.samples)
    assert len(surface.record().recordings) == 49


@pytest.mark.parametrize("condition", [(49.0, 1.0), (351.0, 1.0), (100.0, 0.4), (100.0, 3.6)])
def test_conditions_outside_are_refused(condition: tuple[float, float]) -> None:
    with refused(
        InputError,
        expected=["50…350 mm/s", "0.5…3.5 N"],
        got=[f"{condition[0]:g} mm/s", f"{condition[1]:g} N"],
    ):
        draw_surface(0).magnitude(FREQUENCY_HZ, speed_mm_s=condition[0], force_n=condition[1])


def test_altered_surfaces_are_shifted_and_have_peaks_besides() -> None:
    """Without their peaks they are drawn ones at f / shift; each peak adds its height there."""
    surface, drawn = alter_surface(5), draw_surface(5)
    condition = {"speed_mm_s": 75.0, "force_n": 2.0}
    bare = replace(surface, peaks=np.zeros((0, 4)))
    expected = drawn.magnitude(FREQUENCY_HZ / surface.shift, **condition)
    assert bare.magnitude(FREQUENCY_HZ, **condition) == pytest.approx(expected, rel=1e-12)
    assert sorted(set(surface.peaks[:, 3])) == [0.0, 1.0]
    for peak in surface.peaks:
        one = replace(surface, peaks=peak[None])
        at = peak[0] * 0.5 ** peak[3]  # half of the reference speed
        half = np.array([at, at + peak[1] / 2])
        added = one.magnitude(half, **condition) ** 2 - bare.magnitude(half, **condition) ** 2
        assert added[0] == pytest.approx(2 * added[1])
        level = 10 * np.log10(added[0] / bare.magnitude(at, **condition) ** 2)
        assert level == pytest.approx(peak[2])


@pytest.mark.long("compares estimators: four fits of whole surfaces")
def test_joint_is_nearer_to_altered_surfaces_than_ar_of_order_6() -> None:
    """Two surfaces; a hundred others are in docs/studies/real_surfaces.md."""
    middles = halfway(list(SPEEDS_MM_S), list(FORCES_N))
    for seed in (9040, 9041):
        surface = alter_surface(seed)
        records = surface.record(seed=seed)
        model = fit_texture(records)
        distances = [
            truth_summary(filter_at, surface, middles, frequency_hz=FREQUENCY_HZ)[0]
            for filter_at in (model.peq, fit_ar(records, order=6).filter)
        ]
        assert distances[0] < 0.8 * distances[1]
        assert model.fit is not None
        assert model.fit.blend_defect_db <= 4.0


def test_joint_is_as_close_between_conditions_as_at_them() -> None:
    """Four surfaces; forty others, and the rivals, are in docs/studies/real_surfaces.md."""
    at, between, levels = [], [], []
    for seed in range(4):
        surface = draw_surface(seed)
        model = fit_texture(surface.record(seed=seed))
        assert model.n_layers <= 3
        nodes = [(v, f) for v in SPEEDS_MM_S for f in FORCES_N]
        middles = [(v + 25, f + 0.25) for v in SPEEDS_MM_S[:-1] for f in FORCES_N[:-1]]
        for conditions, found in ((nodes, at), (middles, between)):
            truths = [
                surface.magnitude(FREQUENCY_HZ, speed_mm_s=v, force_n=f) for v, f in conditions
            ]
            responses = [model.peq(v, f).response(FREQUENCY_HZ) for v, f in conditions]
            ratio_db = 20 * np.log10(np.array(responses) / np.array(truths))
            found.append(float(np.sqrt(np.mean(ratio_db**2))))
        power = np.sum(np.array(responses) ** 2, axis=1) / np.sum(np.array(truths) ** 2, axis=1)
        levels.append(10 * np.log10(power))
    assert np.median(at) < 0.75
    assert np.median(between) < 0.6
    assert np.max(between) < 1.2
    assert np.median(np.abs(levels)) < 1
    assert np.max(np.abs(levels)) < 4
