"""Table 3 and the verdicts against the reports they come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tactileq.analysis.spectra.comparison import compare_spectra
from tactileq.analysis.textures.likeness import condition_targets, gfc_table
from tactileq.analysis.textures.recordings import layers_of_recordings, layers_table, spectra_table
from tactileq.analysis.textures.results import TextureResult, simplification_table
from tactileq.modeling import (
    InputError,
    Recording,
    RecordingSet,
    Threshold,
    fit_texture,
    similarity,
    simplify,
    spectrum,
)
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.stimuli.planted.textures import planted_texture, record_texture
from tests.refusals import refused


def targets_of(recordings: RecordingSet, *, rng=None):
    rng = np.random.default_rng(0) if rng is None else rng
    return condition_targets(recordings, rate_hz=5000.0, rng=rng)


def test_gfc_table_holds_means_and_minimum_of_the_reports(results):
    result = results[0]
    targets = targets_of(result.recordings, rng=np.random.default_rng(4))
    table = gfc_table(targets, result.model, result.simplification.model)
    assert table["model"].tolist() == ["full", "simplified"]
    assert table["texture"].tolist() == ["leather", "leather"]
    assert (table["conditions"] == 4).all()
    seeds = np.random.default_rng(4).integers(2**63, size=4)
    for row, model in zip(
        table.to_dict("records"), (result.model, result.simplification.model), strict=True
    ):
        reports = [
            similarity.report(recording, model, rng=np.random.default_rng(seed))
            for recording, seed in zip(result.recordings.recordings, seeds, strict=True)
        ]
        assert row["layers"] == model.n_layers
        assert row["parameters"] == 1 + 3 * model.n_layers
        assert_allclose(row["gfc30_mean"], np.mean([r.gfc30 for r in reports]))
        assert row["gfc30_min"] == min(r.gfc30 for r in reports)
        assert_allclose(row["gfc30_expected"], np.mean([r.expected_gfc30 for r in reports]))
        assert_allclose(row["rms_error_db"], np.mean([abs(r.rms_error_db) for r in reports]))
        assert_allclose(row["gfc30_deficit"], np.mean([r.gfc30_deficit for r in reports]))
        for name in ("gfc30", "gfc5"):
            assert row[f"{name}_floor"] < row[f"{name}_expected"] < 1
            # A fit to this very record may come closer to it than another draw would.
            assert row[f"{name}_floor"] < row[f"{name}_mean"] < 1


def test_no_contact_recordings_are_not_compared(results):
    result = results[0]
    noise = np.random.default_rng(5).normal(0, 1e-4, 2500)
    still = Recording(noise, 5000.0, 200.0, 0.0, "leather", simulated=True)
    recordings = RecordingSet([*result.recordings.recordings, still])
    table = gfc_table(targets_of(recordings), result.model, result.model)
    assert (table["conditions"] == 4).all()


def test_the_verdict_on_every_layer(results):
    simplification = results[0].simplification
    table = simplification_table(simplification)
    assert len(table) == len(simplification.layers)
    for row, verdict in zip(table.to_dict("records"), simplification.layers, strict=True):
        assert row["texture"] == "leather"
        assert row["simulated"] is True
        for name in ("layer", "verdict", "reason"):
            assert row[name] == getattr(verdict, name)
        if np.isnan(verdict.distance_db):
            assert np.isnan(row["worst_frequency_hz"])
        else:
            assert row["distance_db"] == verdict.distance_db
            assert row["worst_frequency_hz"] == verdict.worst_frequency_hz
    assert (table["verdict"] == "kept").sum() == simplification.model.n_layers


def test_a_model_without_layers_has_no_verdicts():
    rng = np.random.default_rng(6)
    flat = RecordingSet(
        Recording(rng.normal(0, 0.1, 2500), 5000.0, speed, force, "flat")
        for speed in (100.0, 200.0)
        for force in (1.0, 2.0)
    )
    model = fit_texture(flat).with_layers([])
    simplification = simplify(model, Threshold.shipped("pen-hold"))
    assert simplification_table(simplification).empty


def test_a_condition_that_was_not_recorded_is_refused(results):
    with refused(InputError, expected=["'leather'", "123 mm/s", "1 N"], got="none"):
        results[0].spectrum_at(123.0, 1.0)


def test_a_recording_has_one_expected_gfc_for_both_models(results):
    result = results[0]
    bare = result.model.with_layers([0])
    table = gfc_table(targets_of(result.recordings), result.model, bare)
    for name in ("gfc30_expected", "gfc5_expected", "gfc30_floor", "gfc5_floor"):
        assert table[name].nunique() == 1
    assert table["gfc30_mean"].nunique() == 2


def with_sensor_noise(clean: RecordingSet, level_g: float, *, rng: np.random.Generator):
    """The set as a noisy sensor records it, and its no-contact recording of 8 s."""
    noisy = [
        replace(r, samples=r.samples + rng.normal(0, level_g, r.samples.size))
        for r in clean.recordings
    ]
    still = Recording(rng.normal(0, level_g, 40000), 5000.0, 0.0, 0.0, clean.texture)
    return RecordingSet(noisy), still


def test_the_sensors_floor_is_subtracted_from_what_models_are_held_against():
    truth = planted_texture(
        "leather", speeds_mm_s=np.array([200.0, 350.0]), forces_n=np.array([1.0, 3.0])
    )
    clean = record_texture(truth, duration_s=1.0, seed=3)
    model = fit_texture(clean)
    noisy, still = with_sensor_noise(clean, 0.05, rng=np.random.default_rng(1))
    gfc30 = [
        gfc_table(targets_of(records), model, model)["gfc30_mean"][0]
        for records in (clean, RecordingSet([*noisy.recordings, still]), noisy)
    ]
    assert gfc30[1] == pytest.approx(gfc30[0], abs=0.006)
    assert gfc30[2] < gfc30[0] - 0.04
    fitted = fit_texture(RecordingSet([*noisy.recordings, still]))
    result = TextureResult(
        RecordingSet([*noisy.recordings, still]),
        fitted,
        simplify(fitted, Threshold.shipped("codec")),
    )
    shown = compare_spectra(result, speed_mm_s=350.0, force_n=3.0)
    wanted = spectrum(clean.recordings[-1]).smoothed()
    strong = (shown.frequency_hz > 50) & (wanted > 0.05)
    assert strong.any()
    assert shown.recording[strong] == pytest.approx(wanted[strong], rel=0.15)


def test_recordings_below_the_floor_are_not_compared(results):
    recordings, model = results[0].recordings, results[0].model
    still = Recording(np.random.default_rng(2).normal(0, 1, 40000), 5000.0, 0.0, 0.0, "leather")
    faint = replace(recordings.recordings[0], samples=recordings.recordings[0].samples / 100)
    quiet = replace(still, samples=still.samples / 500)
    some = RecordingSet([faint, *recordings.recordings[1:], quiet])
    table = gfc_table(targets_of(some), model, model)
    assert (table["conditions"] == 3).all()
    assert np.isfinite(table["log_spectral_distance_db"]).all()
    with refused(InputError, names="leather", expected="floor", got="none"):
        targets_of(RecordingSet([*recordings.recordings, still]))


@pytest.mark.parametrize("table_of", [layers_table, spectra_table])
def test_tables_of_recordings_leave_out_the_floor_and_what_it_adds(results, table_of):
    clean = results[0].recordings
    other = results[1].recordings.recordings
    _, still = with_sensor_noise(clean, 0.02, rng=np.random.default_rng(3))

    def table_from(recordings):
        measured = []
        for texture in dict.fromkeys(recording.texture for recording in recordings):
            measured += recording_spectra(RecordingSet(recordings).of_texture(texture))
        if table_of is spectra_table:
            return spectra_table(measured)
        return table_of(layers_of_recordings(measured, estimator="paper-consistent"))

    table = table_from([*clean.recordings, still, *other])
    assert set(table["force_n"]) == {1.0, 3.0}
    assert table["simulated"].all()
    value = "noise_gain" if table_of is layers_table else "magnitude"
    before, after = (
        t.groupby("texture")[value].mean() for t in (table_from(clean.recordings), table)
    )
    assert after["leather"] < before["leather"]
    # The other texture has no floor of its own.
    alone = table_from(other).groupby("texture")[value].mean()
    assert after[results[1].texture] == alone[results[1].texture]
