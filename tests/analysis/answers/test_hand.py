"""The hand as sessions store it: planted strokes come back, broken-off tries do not."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.hand import HAND_MEASURES, load_hand
from tactileq.analysis.answers.loading import load_responses
from tactileq.experiments.observers.whole_study import simulate_study
from tactileq.experiments.sessions.bids.events import EVENT_COLUMNS
from tactileq.experiments.sessions.bids.physio import (
    PHYSIO_COLUMNS,
    RATE_HZ,
    at_regular_times,
    physio_bytes,
)
from tactileq.experiments.sessions.bids.tables import json_bytes, table_bytes
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.modeling import InputError, Threshold, simplify
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, CORRECT, answer_table
from tactileq.modeling.files.columns import names, sidecar
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

pytestmark = pytest.mark.filterwarnings("error")
Stroke = tuple[int, str, float, float, float]  # trial, surface, duration s, speed mm/s, force N


def answers_of(*trials: tuple[int, int, str, str], person: str = "sub-01") -> pd.DataFrame:
    """Answers to (run, trial, texture, model)."""
    table = pd.DataFrame(trials, columns=["run", "trial", "texture", "model"])
    kinds = {"run": float, "trial": float}
    return table.astype(kinds).assign(participant_id=person, session="ses-01")


@pytest.fixture
def store(tmp_path: Path) -> Callable[..., Path]:
    """Write the hand of one start of a session by the program that stores real ones."""

    def write(
        strokes: Sequence[Stroke],
        *,
        task: str = "absolute",
        run: int = 1,
        person: str = "sub-01",
        assumed: bool = False,
    ) -> Path:
        beh = tmp_path / person / "ses-01" / "beh"
        beh.mkdir(parents=True, exist_ok=True)
        stem = f"{person}_ses-01_task-{task}"
        begun_s, parts = 0.0, []
        for number, (trial, surface, duration_s, speed, force) in enumerate(strokes, start=1):
            # Held for the whole stroke, since speeds are linear between readings.
            time_s = begun_s + np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
            part = pd.DataFrame({"time_s": time_s, "speed_mm_s": speed, "force_n": force})
            parts.append(part.assign(trial=trial, presentation=number, surface=surface))
            begun_s = time_s[-1] + 1.0
        hand = pd.concat(parts).assign(force_assumed=int(assumed))
        path = beh / f"{stem}_recording-start{run}_physio.tsv.gz"
        path.write_bytes(physio_bytes(at_regular_times(hand)))
        told = {
            "SamplingFrequency": RATE_HZ,
            "Columns": names(PHYSIO_COLUMNS),
            **sidecar(PHYSIO_COLUMNS),
        }
        path.with_name(path.name.replace(".tsv.gz", ".json")).write_bytes(json_bytes(told))
        shown = [
            {"trial_type": "presented", "run": run, "trial": s[0], "surface": s[1]} for s in strokes
        ]
        events = beh / f"{stem}_events.tsv"
        if events.is_file():
            earlier = events.read_bytes()
            events.write_bytes(earlier + table_bytes(EVENT_COLUMNS, shown).split(b"\n", 1)[1])
        else:
            events.write_bytes(table_bytes(EVENT_COLUMNS, shown))
        return path

    return write


def test_planted_strokes_are_found(store, tmp_path):
    store(
        [
            (2, "virtual", 2.0, 100.0, 1.0),
            (2, "real", 9.0, 500.0, 9.0),
            (2, "virtual", 2.0, -200.0, 2.0),
            (3, "virtual", 1.0, 80.0, 1.2),
        ]
    )
    answers = answers_of((1, 2, "oak", "full"), (1, 3, "oak", "simplified"))
    found = load_hand(tmp_path, {"absolute": answers}).set_index("model")
    assert found["speed_mm_s"].tolist() == pytest.approx([150.0, 80.0])
    assert found["force_n"].tolist() == pytest.approx([1.5, 1.2])
    assert found["contact_s"].tolist() == pytest.approx([4.0, 1.0])
    assert found["presentations"].tolist() == [2, 1]
    assert found["trials"].tolist() == [1, 1]


def test_off_the_surface_counts_as_no_contact(store, tmp_path):
    store([(2, "virtual", 1.0, 100.0, 1.0), (2, "virtual", 3.0, 400.0, 0.0)])
    (row,) = load_hand(tmp_path, {"absolute": answers_of((1, 2, "oak", "full"))}).to_dict("records")
    assert row["speed_mm_s"] == pytest.approx(100.0)
    assert row["contact_s"] == pytest.approx(1.0)
    assert row["presentations"] == 2


def test_a_hand_that_never_touched_has_a_time_of_0_and_no_speed(store, tmp_path):
    store([(2, "virtual", 1.0, 100.0, 0.0), (3, "virtual", 1.0, 50.0, 1.0)])
    answers = answers_of((1, 2, "oak", "full"), (1, 3, "oak", "simplified"))
    found = load_hand(tmp_path, {"absolute": answers})
    assert found["contact_s"].tolist() == pytest.approx([0.0, 1.0])
    assert found["speed_mm_s"].isna().tolist() == [True, False]


def test_a_force_that_was_assumed_tells_contact_but_is_no_force(store, tmp_path):
    store([(2, "virtual", 1.0, 100.0, 1.5)], assumed=True)
    (row,) = load_hand(tmp_path, {"absolute": answers_of((1, 2, "oak", "full"))}).to_dict("records")
    assert np.isnan(row["force_n"])
    assert row["contact_s"] == pytest.approx(1.0)
    assert row["speed_mm_s"] == pytest.approx(100.0)


def test_a_try_that_broke_off_is_left_out(store, tmp_path):
    # Trial 3 broke off in the first start and was answered in the second, where 4 broke off.
    store([(2, "virtual", 1.0, 10.0, 1.0), (3, "virtual", 1.0, 900.0, 9.0)])
    store([(3, "virtual", 2.0, 30.0, 2.0), (4, "virtual", 1.0, 900.0, 9.0)], run=2)
    answers = answers_of((1, 2, "oak", "full"), (2, 3, "oak", "simplified"))
    found = load_hand(tmp_path, {"absolute": answers}).set_index("model")
    assert found["speed_mm_s"].tolist() == pytest.approx([10.0, 30.0])
    assert found["contact_s"].tolist() == pytest.approx([1.0, 2.0])
    assert found["presentations"].tolist() == [1, 1]


def test_repeats_of_a_cell_count_the_same(store, tmp_path):
    store([(2, "virtual", 1.0, 100.0, 1.0), (3, "virtual", 9.0, 200.0, 2.0)])
    answers = answers_of((1, 2, "oak", "full"), (1, 3, "oak", "full"))
    (row,) = load_hand(tmp_path, {"absolute": answers}).to_dict("records")
    assert row["trials"] == 2
    assert [row[name] for name in HAND_MEASURES] == pytest.approx([150.0, 1.5, 5.0, 1.0])


@pytest.mark.parametrize(("both_models", "rows"), [(False, 1), (True, 0)])
def test_a_task_counts_where_its_trials_hold_one_model(
    store, tmp_path, monkeypatch, both_models, rows
):
    table = answer_table(
        CORRECT, title="pair", texture="", model="", both_models=both_models, chance=1 / 2
    )
    monkeypatch.setitem(ANSWER_TABLES, "pair", table)
    store([(2, "virtual", 1.0, 100.0, 1.0)], task="pair")
    found = load_hand(tmp_path, {"pair": answers_of((1, 2, "oak", "full"))})
    assert len(found) == rows
    assert found["speed_mm_s"].tolist() == pytest.approx([100.0] * rows)


def test_a_session_without_a_hand_has_rows_without_values(store, tmp_path):
    store([(2, "virtual", 1.0, 100.0, 1.0)])
    other = answers_of((1, 2, "oak", "full"), person="sub-02")
    both = pd.concat([answers_of((1, 2, "oak", "full")), other])
    found = load_hand(tmp_path, {"absolute": both}).set_index("participant_id")
    assert found.loc["sub-01", list(HAND_MEASURES)].notna().all()
    assert found.loc["sub-02", list(HAND_MEASURES)].isna().all()
    assert found.loc["sub-02", "trials"] == 1


def test_where_nobody_stored_a_hand_there_are_no_rows(tmp_path):
    answers = {"absolute": answers_of((1, 2, "oak", "full")), "oddity": answers_of()}
    for given in (answers, {}):
        found = load_hand(tmp_path, given)
        assert found.empty
        assert {"participant_id", "speed_mm_s", "contact_s"} <= set(found)


def test_damaged_files_are_refused_in_one_sentence(store, tmp_path):
    path = store([(2, "virtual", 1.0, 100.0, 1.0)])
    sidecar = path.with_name(path.name.replace(".tsv.gz", ".json"))
    events = path.with_name("sub-01_ses-01_task-absolute_events.tsv")
    whole = {file: file.read_bytes() for file in (path, sidecar, events)}
    told = json.loads(whole[sidecar])
    damaged = [
        (path, whole[path][:-9]),
        (path, whole[path][:40] + bytes(9) + whole[path][49:]),
        (path, b"no gzip"),
        (path, gzip.compress(b"a\tb\nc\td\te\tf\tg\th\ti\tj\n")),
        (path, gzip.compress(b"a\tb\tc\td\te\tf\n")),
        (path, gzip.compress(b"1\t2\t3\t4\t5\t6\t7\n")),
        (path, gzip.compress(b"")),
        (sidecar, b"[1]"),
        (sidecar, json.dumps({**told, "Columns": ["speed_mm_s"]}).encode()),
        (sidecar, json.dumps({**told, "SamplingFrequency": 0}).encode()),
        (sidecar, json.dumps({**told, "surface": {"Levels": ["a virtual surface"]}}).encode()),
        (sidecar, json.dumps({**told, "surface": 3}).encode()),
        (events, whole[events].replace(b"trial_type", b"tried_type")),
        (events, b""),
        (events, whole[events].replace(b"presented\t1\t2", b"presented\tx\t2")),
        (events, b"\xff\xfe\x00"),
    ]
    answers = {"absolute": answers_of((1, 2, "oak", "full"))}
    for file, data in damaged:
        file.write_bytes(data)
        with refused(InputError, expected=file) as caught:
            load_hand(tmp_path, answers)
        assert "\n" not in str(caught.value)
        file.write_bytes(whole[file])
    assert len(load_hand(tmp_path, answers)) == 1


def test_presentations_are_those_that_the_answers_count(tmp_path):
    """A simulated study by the loop and the store of real ones, whose hand touches nothing."""
    textures = ("leather", "MDF")
    truths = {texture: planted_texture(texture) for texture in textures}
    threshold = Threshold.shipped("codec")
    plan = TaskPlan(participants=2, schedule="interleaved", training_trials=1)
    study = Study(
        name="Two surfaces",
        seed=3,
        textures=textures,
        trays={"leather": "A", "MDF": "B"},
        tasks={"absolute": plan, "relative": plan},
    )
    simplified = {
        name: simplify(t, threshold, criterion="paper-fft").model for name, t in truths.items()
    }
    simulate_study(
        study,
        real=truths,
        models=ModelSets(sets={"full": truths, "simplified": simplified}),
        rig=SimulatedRig(seed=1),
        data_folder=tmp_path / "data",
        seed=7,
        threshold=threshold,
    )
    answers = load_responses(tmp_path / "data").answers
    found = load_hand(tmp_path / "data", answers)
    assert found[["speed_mm_s", "force_n", "contact_s"]].isna().all(axis=None)
    cell = ["participant_id", "texture", "model"]
    pressed = answers["relative"].groupby(cell)["presses"].mean()
    of_choices = found[found["task"] == "relative"].set_index(cell)["presentations"]
    assert of_choices.sort_index().tolist() == pressed.sort_index().tolist()
    rated = answers["absolute"]
    begun_virtual = (rated["first_surface"] == "virtual").astype(int)
    virtual = (rated["toggles"] + 1 + begun_virtual) // 2
    counted = virtual.groupby([rated[name] for name in cell]).mean()
    of_ratings = found[found["task"] == "absolute"].set_index(cell)["presentations"]
    assert of_ratings.sort_index().tolist() == counted.sort_index().tolist()
    assert len(found) == 2 * 2 * 2 * 2
