"""Table 3 and the verdicts against the reports they come from."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from analysis.tables import gfc_table, simplification_table
from modeling import (
    InputError,
    Recording,
    RecordingSet,
    Threshold,
    fit_texture,
    similarity,
    simplify,
)


def test_gfc_table_holds_means_and_minimum_of_the_reports(results):
    result = results[0]
    table = gfc_table(
        result.recordings,
        result.model,
        result.simplification.model,
        rng=np.random.default_rng(4),
    )
    assert table["model"].tolist() == ["full", "simplified"]
    assert table["texture"].tolist() == ["leather", "leather"]
    assert (table["conditions"] == 4).all()
    rng = np.random.default_rng(4)
    for row, model in zip(
        table.to_dict("records"), (result.model, result.simplification.model), strict=True
    ):
        reports = [similarity.report(r, model, rng=rng) for r in result.recordings.recordings]
        assert row["layers"] == model.n_layers
        assert row["parameters"] == 1 + 3 * model.n_layers
        assert_allclose(row["gfc30_mean"], np.mean([r.gfc30 for r in reports]))
        assert row["gfc30_min"] == min(r.gfc30 for r in reports)
        assert_allclose(row["gfc30_ceiling"], np.mean([r.ceiling_gfc30 for r in reports]))
        assert_allclose(row["rms_error_db"], np.mean([abs(r.rms_error_db) for r in reports]))
        assert_allclose(row["oracle_gap"], np.mean([r.oracle_gap for r in reports]))
        for name in ("gfc30", "gfc5"):
            assert row[f"{name}_floor"] < row[f"{name}_mean"] < row[f"{name}_ceiling"] < 1


def test_no_contact_recordings_are_not_compared(results):
    result = results[0]
    noise = np.random.default_rng(5).normal(0, 1e-4, 2500)
    still = Recording(noise, 5000.0, 200.0, 0.0, "leather", simulated=True)
    recordings = RecordingSet([*result.recordings.recordings, still])
    table = gfc_table(recordings, result.model, result.model, rng=np.random.default_rng(0))
    assert (table["conditions"] == 4).all()


def test_the_verdict_on_every_layer(results):
    simplification = results[0].simplification
    table = simplification_table(simplification)
    assert len(table) == len(simplification.layers)
    for row, verdict in zip(table.to_dict("records"), simplification.layers, strict=True):
        assert row["texture"] == "leather"
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
    with pytest.raises(InputError, match="got none; choose a recorded condition"):
        results[0].recording_at(123.0, 1.0)
