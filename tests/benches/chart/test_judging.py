"""The rows of one texture: what is known of floor and ceiling, costs, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tactileq.benches.chart.judging import PRECISIONS, UPDATES_MS, Judged, judge
from tactileq.benches.chart.methods import (
    LEFT_TO_FULL,
    METHODS,
    Subject,
    chosen_methods,
    fit_method,
)
from tactileq.benches.chart.surfaces import (
    Origin,
    Simulated,
    judged_stroke,
    load_material,
    recorded_sources,
    simulated_sources,
    toolkit_sources,
)
from tactileq.modeling import InputError, RecordingSet, fit_ar
from tactileq.stimuli.planted.drawn import FORCES_N, SPEEDS_MM_S, draw_surface
from tests.refusals import refused


@pytest.fixture
def rows(judged: list[Judged]) -> pd.DataFrame:
    return judged[0].rows


def test_every_method_has_all_its_variants(rows: pd.DataFrame) -> None:
    counts = rows.groupby("method").size()
    every = len(UPDATES_MS) * len(PRECISIONS)
    assert counts["joint, 2 layers"] == counts["white noise"] == 2 * every  # linear, logarithmic
    assert counts["AR(6)"] == counts["truth"] == len(UPDATES_MS)
    assert counts["IIR, 2 sections"] == counts["loops of field"] == len(UPDATES_MS)
    assert counts["grains, 1/16 s"] == counts["FFT, 1/16 s"] == 1
    assert rows["simulated"].all()


def test_the_truth_is_the_ceiling_and_white_noise_the_floor(rows: pd.DataFrame) -> None:
    distance = rows.groupby("method")["between_distance_db"].median()
    assert distance["truth"] == 0
    assert distance.drop("truth").min() > 0
    assert distance.idxmax() == "white noise"
    truth = rows[rows["method"] == "truth"]
    assert truth["at_gfc30"].to_numpy() == pytest.approx(1)
    assert truth["operations"].isna().all()
    # What a late update costs is all that is wrong with it.
    late = truth.drop_duplicates("update_ms").set_index("update_ms")["stroking_distance_db"]
    assert late[1.0] < 1e-9  # an update at every sample of 1 kHz
    assert late[1.0] < late[4.0] < late[16.0]


def test_white_noise_has_the_level_of_the_records(rows: pd.DataFrame) -> None:
    white = rows[rows["method"] == "white noise"]
    assert (white["layers"] == 0).all()
    assert (white["numbers"] == 49).all()
    # Levels of records of 1 s scatter; the whole band is 490 of 500 Hz.
    assert (white["at_level_db"] < 0.6).all()


def test_costs_depend_on_layers_updates_and_precision_as_counted(rows: pd.DataFrame) -> None:
    two = rows[(rows["method"] == "joint, 2 layers") & (rows["blending"] == "linear")]
    double = two[two["precision"] == "double"].set_index("update_ms")
    single = two[two["precision"] == "single"].set_index("update_ms")
    assert (double["operations"] == single["operations"]).all()
    assert (double["bytes"] > single["bytes"]).all()
    assert double["operations"].diff().dropna().lt(0).all()
    assert double["most_operations"].nunique() == 1
    assert double["numbers"].tolist() == [49 * 7] * 3
    assert single["single_error_db"].lt(-90).all()


def test_fitting_takes_time(rows: pd.DataFrame) -> None:
    assert (rows["fit_ms"] > 0).all()
    assert rows.groupby("method")["fit_ms"].nunique().eq(1).all()


def test_recordings_have_no_truth_to_be_a_method() -> None:
    with refused(InputError, expected="truth", got="recordings"):
        fit_method("truth", Subject([]))


def test_what_cannot_be_fitted_is_warned_of(tmp_path: Path) -> None:
    records = draw_surface(5).record([50.0, 150.0, 350.0], [0.5, 1.5, 3.5], seed=5)
    folder = tmp_path / "uncalibrated"
    RecordingSet(replace(record, unit="arbitrary") for record in records.recordings).save(folder)
    [source] = recorded_sources([folder], [], both_halves=False)
    found = judge(source, methods=("simplified, energy", "white noise"))
    assert set(found.rows["method"]) == {"white noise"}
    [warning] = found.warnings
    assert warning.startswith("no simplified, energy: drawn 5: expected a model in g")


def test_a_stroke_is_judged_on_the_usual_grid() -> None:
    for rate_hz in (1000.0, 5000.0):
        stroke = judged_stroke(rate_hz)
        speed = np.abs(stroke.hand.speed_mm_s[stroke.places])
        assert len(set(stroke.places)) == 24
        assert (speed >= SPEEDS_MM_S[0]).all()
        assert (speed <= SPEEDS_MM_S[-1]).all()
        force = stroke.hand.force_n[stroke.places]
        assert (force >= FORCES_N[0]).all()
        assert (force <= FORCES_N[-1]).all()


def test_names_of_methods() -> None:
    assert chosen_methods([], full=True) == tuple(METHODS)
    assert set(METHODS) - set(chosen_methods([], full=False)) == set(LEFT_TO_FULL)
    assert chosen_methods(["truth", "AR(6)"], full=False) == ("AR(6)", "truth")
    with refused(InputError, expected=["joint", "AR(6)"], got="'AR(7)'"):
        chosen_methods(["AR(7)"], full=True)


def test_sources_are_drawn_surfaces_and_planted_textures() -> None:
    sources = simulated_sources(Simulated(2, ("canvas",)))
    assert [(s.kind, s.name) for s in sources] == [
        ("drawn", "drawn 1000"),
        ("drawn", "drawn 1001"),
        ("planted", "canvas"),
    ]
    assert sources[0].seed != sources[1].seed


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of a drawn surface at 3 × 3 conditions."""
    folder = tmp_path_factory.mktemp("recorded") / "oak"
    draw_surface(5).record([50.0, 150.0, 350.0], [0.5, 1.5, 3.5], seed=5).save(folder)
    return folder


METHODS_FOR_RECORDS = ("AR(6)", "white noise", "truth")


def test_of_recordings_every_second_condition_is_held_out(recorded: Path) -> None:
    sources = recorded_sources([recorded], [], both_halves=True)
    assert [(s.kind, s.name, s.fold) for s in sources] == [
        ("recorded", "drawn 5", 1),
        ("recorded", "drawn 5", 0),
    ]
    materials = [load_material(source) for source in sources]
    sides = {(50.0, 1.5), (150.0, 0.5), (150.0, 3.5), (350.0, 1.5)}
    assert set(materials[0].between) == sides
    assert set(materials[1].between) == {(150.0, 1.5)}
    for material in materials:
        assert not set(material.at) & set(material.between)
        assert {r.condition for r, _ in material.measured} == set(material.at)
        assert material.truth is None
    rows = judge(sources[0], methods=METHODS_FOR_RECORDS).rows
    assert set(rows["method"]) == {"AR(6)", "white noise"}  # no truth is known
    assert rows["stroking_distance_db"].isna().all()
    by_method = rows.groupby("method")["between_distance_db"].median()
    assert by_method["AR(6)"] < by_method["white noise"]


def test_models_that_were_given_are_judged_beside_the_others(
    recorded: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "models"
    folder.mkdir()
    fit_ar(RecordingSet.load(recorded), order=20).save(folder / "oak.json")
    [source] = recorded_sources([recorded], [folder], both_halves=False)
    rows = judge(source, methods=("AR(6)",)).rows
    given = rows[rows["family"] == "models given"]
    assert set(given["method"]) == {f"models of {folder}"}
    assert given["fit_ms"].isna().all()
    # It was fitted to all conditions: of none is it known that it has not seen it.
    assert given["between_distance_db"].isna().all()
    assert given["at_distance_db"].median() < rows["at_distance_db"].max()


def test_a_texture_without_the_model_asked_for_is_refused(recorded: Path, tmp_path: Path) -> None:
    folder = tmp_path / "models"
    folder.mkdir()
    fit_ar(draw_surface(6).record([50.0, 150.0], [0.5, 1.5]), order=6).save(folder / "elm.json")
    with refused(InputError, expected=["'drawn 5'", folder], got="'drawn 6'"):
        recorded_sources([recorded], [folder], both_halves=False)


def test_recordings_too_few_to_hold_any_out_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "few"
    draw_surface(5).record([50.0, 150.0], [0.5, 1.5]).save(folder)
    [source] = recorded_sources([folder], [], both_halves=False)
    with refused(InputError, expected="3 speeds × 3 forces", got="2 × 2"):
        judge(source, methods=METHODS_FOR_RECORDS)


def test_toolkit_models_are_a_truth(tmp_path: Path, hatt_xml) -> None:
    path = tmp_path / "Models_A.xml"
    path.write_text(hatt_xml(), encoding="utf-8")
    [source] = toolkit_sources([path])
    assert source == Origin("toolkit", "Planted 1", 0, path)
    rows = judge(source, methods=("AR(6)", "white noise", "truth")).rows
    by_method = rows.groupby("method")["between_distance_db"].median()
    assert by_method["truth"] == 0
    assert by_method["AR(6)"] < by_method["white noise"]
    assert rows["simulated"].all()
