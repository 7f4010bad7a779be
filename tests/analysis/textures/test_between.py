"""How models are judged between conditions: against truths in closed form, and by leaving out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.textures.between import (
    DISTANCE,
    LEVEL,
    FilterAt,
    Measured,
    distances_to_recordings,
    distances_to_truth,
    fit_like,
    halfway,
    left_out_by_model,
    left_out_summary,
    left_out_table,
    median_and_worst,
    planted_between_table,
    sentence,
    truth_summary,
    worth_recording,
)
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import RecordingSet, Threshold, fit_texture, simplify
from tactileq.modeling.arrays import Floats
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.fitting.texture import fit_spectra
from tactileq.stimuli.planted.drawn import draw_surface
from tactileq.stimuli.planted.textures import PlantedSurface, planted_texture, record_texture

FREQUENCY_HZ = np.arange(15.0, 481.0)
FIVE_SPEEDS = np.array([60.0, 100.0, 160.0, 230.0, 300.0])
SPEEDS, FORCES = np.array([100.0, 200.0, 300.0]), np.array([1.0, 2.0, 3.0])


class Louder:
    """A surface's own response, so many decibels too loud above 200 Hz, at rising speeds more."""

    def __init__(self, speed_mm_s: float, force_n: float) -> None:
        self.speed_mm_s, self.force_n = speed_mm_s, force_n

    def response(self, frequency_hz: Floats) -> Floats:
        true = draw_surface(1).magnitude(
            frequency_hz, speed_mm_s=self.speed_mm_s, force_n=self.force_n
        )
        return true * 10 ** (self.speed_mm_s / 100 / 20 * (frequency_hz > 200))


def test_halfway_is_the_middle_of_each_cell() -> None:
    assert halfway([100.0, 200.0, 400.0], [1.0, 3.0]) == [(150.0, 2.0), (300.0, 2.0)]
    assert halfway([100.0], [1.0, 2.0]) == [(100.0, 1.5)]


def test_distances_to_truth_in_closed_form() -> None:
    """x dB over a share p of the band: distance x·√p; the level from the powers of the parts."""
    conditions = [(100.0, 1.0), (300.0, 2.0)]
    table = distances_to_truth(Louder, draw_surface(1), conditions, frequency_hz=FREQUENCY_HZ)
    share = float((FREQUENCY_HZ > 200).mean())
    assert list(table["speed_mm_s"]) == [100.0, 300.0]
    assert table[DISTANCE].to_numpy() == pytest.approx(np.sqrt(share) * np.array([1.0, 3.0]))
    for (speed, force), level in zip(conditions, table[LEVEL], strict=True):
        power = draw_surface(1).magnitude(FREQUENCY_HZ, speed_mm_s=speed, force_n=force) ** 2
        high = power[FREQUENCY_HZ > 200].sum() / power.sum()
        expected = 10 * np.log10(1 - high + high * 10 ** (speed / 1000))
        assert level == pytest.approx(expected, abs=1e-9)
    rms, median, worst = truth_summary(
        Louder, draw_surface(1), conditions, frequency_hz=FREQUENCY_HZ
    )
    assert rms == pytest.approx(np.sqrt(share * (1 + 9) / 2))
    assert median == pytest.approx(table[LEVEL].mean())
    assert worst == pytest.approx(table[LEVEL].max())


def planted_records(speeds: Floats = SPEEDS, forces: Floats = FORCES) -> RecordingSet:
    texture = planted_texture("canvas", speeds_mm_s=speeds, forces_n=forces)
    return record_texture(texture, duration_s=1.0)


def test_the_truth_is_close_to_its_recordings_and_louder_is_louder() -> None:
    measured = recording_spectra(planted_records())
    truth = planted_texture("canvas", speeds_mm_s=SPEEDS, forces_n=FORCES)
    table = distances_to_recordings(truth.peq, measured)
    assert len(table) == 9
    assert (table[LEVEL].abs() < 0.5).all()
    assert (table[DISTANCE] < 1).all()
    twice = replace(truth, noise_gains=2 * truth.noise_gains, gains=2 * truth.gains)
    louder = distances_to_recordings(twice.peq, measured)
    expected = table[LEVEL] + 20 * np.log10(2)
    assert louder[LEVEL].to_numpy() == pytest.approx(expected.to_numpy())


def refitted(measured: Measured) -> FilterAt:
    """A model of its own, found again from the beginning."""
    return fit_spectra(measured).peq


def test_layers_are_kept_and_fitted_again_to_what_is_left() -> None:
    """A tone louder in one half of the conditions than in the other must follow the half."""
    records = planted_records()
    model = fit_texture(records)
    louder = [replace(r, samples=2 * r.samples) for r in records if r.condition != (200.0, 2.0)]
    measured = recording_spectra(RecordingSet(louder))
    again = fit_spectra(measured, like=model)
    assert again.n_layers == model.n_layers
    assert (np.sign(again.gains[0, 0]) == np.sign(model.gains[0, 0])).all()
    found = distances_to_recordings(again.peq, measured)
    assert (found[LEVEL].abs() < 0.5).all()
    whole = left_out_table(recording_spectra(records), refitted)
    table = left_out_table(recording_spectra(records), fit_like(model))
    assert table[DISTANCE].median() == pytest.approx(whole[DISTANCE].median(), rel=0.3)


def test_conditions_that_are_predicted_badly_are_worth_recording() -> None:
    table = pd.DataFrame(
        {
            "speed_mm_s": [100.0, 200.0, 300.0, 400.0, 500.0],
            "force_n": 1.0,
            LEVEL: 0.0,
            DISTANCE: [1.0, 1.1, 5.0, 0.9, 2.5],
        }
    )
    assert worth_recording(table) == [(300.0, 1.0), (500.0, 1.0)]
    assert worth_recording(table, most=1) == [(300.0, 1.0)]
    assert worth_recording(table.iloc[:0]) == []


def test_every_condition_but_the_corners_is_left_out_once() -> None:
    measured = recording_spectra(planted_records())
    table = left_out_table(measured, refitted)
    left_out = set(zip(table["speed_mm_s"], table["force_n"], strict=True))
    corners = {(v, f) for v in (100.0, 300.0) for f in (1.0, 3.0)}
    assert left_out == {(v, f) for v in SPEEDS for f in FORCES} - corners
    assert len(table) == len(left_out)


def test_what_is_left_out_is_foretold_without_it() -> None:
    """A condition that differs from its neighbours is predicted by them, not by itself."""
    records = [
        replace(r, samples=10 * r.samples) if r.condition == (200.0, 2.0) else r
        for r in planted_records()
    ]
    table = left_out_table(recording_spectra(RecordingSet(records)), refitted)
    middle = table[(table["speed_mm_s"] == 200.0) & (table["force_n"] == 2.0)]
    assert float(middle[LEVEL].iloc[0]) == pytest.approx(-20, abs=3)


@pytest.mark.parametrize(
    ("speeds", "forces"), [(SPEEDS[:1], FORCES[:2]), (SPEEDS[:2], FORCES[:2]), (SPEEDS, FORCES[:1])]
)
def test_small_grids(speeds: Floats, forces: Floats) -> None:
    """2 × 2 has nothing but corners; a line of three has one condition between its ends."""
    table = left_out_table(recording_spectra(planted_records(speeds, forces)), refitted)
    assert len(table) == (1 if speeds.size == 3 else 0)
    assert sentence(table).startswith(
        "log-spectral distance" if len(table) else "the grid is too small"
    )


def test_silent_conditions_are_not_left_out() -> None:
    records = planted_records(SPEEDS, FORCES[:2])
    floor = replace(records.recordings[0], samples=1e-3 * records.recordings[0].samples, force_n=0)
    silent = [
        replace(r, samples=floor.samples) if r.condition == (200.0, 1.0) else r for r in records
    ]
    table = left_out_table(recording_spectra(RecordingSet([*silent, floor])), refitted)
    assert list(zip(table["speed_mm_s"], table["force_n"], strict=True)) == [(200.0, 2.0)]


def test_rivals_predict_the_same_conditions() -> None:
    """Layers that are planted are predicted best by layers, and by a field better than by AR."""
    records = planted_records(FIVE_SPEEDS, FORCES)
    tables = left_out_by_model(recording_spectra(records), fit_texture(records))
    assert list(tables) == ["joint", "AR(20)", "a field of spectra"]
    joint, ar, field = (table[DISTANCE].median() for table in tables.values())
    assert joint < field < ar
    places = [table[["speed_mm_s", "force_n"]].to_numpy().tolist() for table in tables.values()]
    assert places[0] == places[1] == places[2]


def test_median_and_worst_are_named() -> None:
    table = pd.DataFrame(
        {
            "speed_mm_s": [100.0, 200.0, 300.0],
            "force_n": [1.0, 2.5, 1.0],
            LEVEL: [0.5, -4.0, 1.0],
            DISTANCE: [3.0, 2.0, 1.0],
        }
    )
    assert median_and_worst(table) == {
        "conditions": 3,
        "median_level_error_db": 1.0,
        "worst_level_error_db": -4.0,
        "worst_level_error_at": "200 mm/s, 2.5 N",
        "median_distance_db": 2.0,
        "worst_distance_db": 3.0,
        "worst_distance_at": "100 mm/s, 1 N",
    }
    assert "at worst -4.00 dB (200 mm/s, 2.5 N)" in sentence(table)
    assert median_and_worst(table.iloc[:0]) == {}


def test_planted_textures_are_judged_half_way() -> None:
    """The truth itself is as far off as the two rates warp; half of it is 6 dB too quiet."""
    records = planted_records()
    truth = planted_texture("canvas", speeds_mm_s=SPEEDS, forces_n=FORCES)
    half = replace(truth, noise_gains=truth.noise_gains / 2, gains=truth.gains / 2)
    fitted = fit_texture(records)
    results = TextureResult(
        recordings=records,
        model=fitted,
        simplification=simplify(fitted, Threshold.shipped("pen-hold")),
        other_estimates=(truth, half),
        left_out={"joint": left_out_table(recording_spectra(records), refitted)},
    )
    table = planted_between_table([results])
    _, itself, quieter = table.to_dict("records")
    assert itself["distance_at_db"] < 0.5
    assert quieter["distance_at_db"] == pytest.approx(20 * np.log10(2), abs=0.5)
    assert quieter["worst_level_error_between_db"] == pytest.approx(20 * np.log10(2), abs=0.5)
    # What blending adds to the truth is what is left of it half-way.
    surface = PlantedSurface("canvas")
    frequency = np.arange(15.0, 0.96 * 2500, 3.0)
    there, _, _ = truth_summary(truth.peq, surface, halfway(SPEEDS, FORCES), frequency_hz=frequency)
    assert itself["distance_between_db"] == pytest.approx(there)
    summary = left_out_summary([results])
    assert summary[["texture", "foretold_by", "conditions"]].to_numpy().tolist() == [
        ["canvas", "joint", 5]
    ]
