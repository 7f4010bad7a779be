"""Copies of data that identify nobody: verified as the original, with the same answers."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from tactileq.experiments.publishing.presented import render_presentation
from tactileq.experiments.publishing.redacting import BEGINNING, LEFT_OUT, _beginnings, redact
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.stored_sessions import StoredSession, held_sessions
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.verification.verifying import verify_data
from tactileq.modeling import InputError
from tests.experiments.verification.small_studies import (
    Stopping,
    eventful_study,
    run_all,
    run_one,
    small_study,
)
from tests.refusals import refused

TEXTURES = ("canvas", "PVC")
SOURCES = {"full": "models/full", "simplified": "models/simplified"}


@pytest.fixture(scope="module")
def finished(models: ModelSets, tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("study") / "data"
    run_all(root, small_study(TEXTURES), models)
    return root


def everything(folder: Path) -> str:
    paths = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return "\n".join(path.read_bytes().decode("utf-8", "replace") for path in paths)


def test_a_copy_is_verified_and_has_the_same_answers(finished: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    redacted = redact(finished, copy, sources=SOURCES, described={"Authors": ["A. Author"]})
    found = verify_data(copy)
    assert (found.differences, len(found.sessions)) == ((), 4)
    assert found.seal != verify_data(finished).seal
    held, _ = held_sessions(finished)
    assert redacted.seals == {one.files.stem: one.state.events[-1]["seal"] for one in held}
    for pattern in ("sub-*/ses-*/beh/*_beh.tsv", "sub-*/ses-*/beh/*_events.tsv"):
        for path in finished.glob(pattern):
            assert (copy / path.relative_to(finished)).read_bytes() == path.read_bytes()
    assert (copy / "participants.tsv").read_bytes() == (finished / "participants.tsv").read_bytes()
    description = json.loads((copy / "dataset_description.json").read_text())
    assert description["Authors"] == ["A. Author"]


def test_no_time_of_day_pseudonym_or_platform_is_left(finished: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    redacted = redact(finished, copy, sources=SOURCES, described={})
    text = everything(copy)
    moments = re.findall(r"\d{4}-\d\d-\d\dT\d\d:\d\d", text)
    assert set(moments) <= {f"2000-01-01T12:{minute:02d}" for minute in (0, 10)}
    assert moments
    held, _ = held_sessions(finished)
    codes = {one.manifest.code for one in held}
    assert set(redacted.secrets) == codes
    for word in (*codes, held[0].manifest.platform):
        assert word not in text
        assert word in everything(finished)


@pytest.mark.parametrize("seed", range(21, 24))
def test_copies_of_eventful_studies_are_verified(
    seed: int, models: ModelSets, tmp_path: Path
) -> None:
    """Killed and resumed sessions, withdrawals, dropouts: seals that name others still do."""
    eventful_study(tmp_path / "data", models, seed=seed)
    original = verify_data(tmp_path / "data")
    if not original.sessions:
        return
    redact(tmp_path / "data", tmp_path / "copy", sources=SOURCES, described={})
    found = verify_data(tmp_path / "copy")
    assert (found.differences, found.sessions) == ((), original.sessions)
    days = sorted((tmp_path / "data").glob("sub-*/sub-*_sessions.tsv"))
    for table in days:
        copied = tmp_path / "copy" / table.relative_to(tmp_path / "data")
        assert copied.read_bytes() == table.read_bytes()


def test_free_text_is_left_out_unless_it_is_asked_for(models: ModelSets, tmp_path: Path) -> None:
    root = tmp_path / "data"
    run_one(root, small_study(TEXTURES), models, respondent=Stopping(1, after=2))
    for free_text in (False, True):
        copy = tmp_path / f"copy-{free_text}"
        redact(root, copy, sources=SOURCES, described={}, free_text=free_text)
        log = next(copy.glob("sourcedata/*/*/*_log.jsonl")).read_text()
        assert ("tired" in log) is free_text
        assert (LEFT_OUT in log) is not free_text
        assert verify_data(copy).differences == ()


def test_what_participants_read_is_copied(models: ModelSets, tmp_path: Path) -> None:
    root, texts = tmp_path / "data", {"en": {"rest.title": "Time for a break"}}
    run_one(root, small_study(TEXTURES), models, texts=texts)
    (root / "sourcedata/texts_en_of_nobody.toml").write_text("notes")
    redact(root, tmp_path / "copy", sources=SOURCES, described={})
    (file,) = (tmp_path / "copy").glob("sourcedata/texts_*")
    assert "Time for a break" in file.read_text()
    assert verify_data(tmp_path / "copy").differences == ()


def test_a_running_or_damaged_session_is_not_published(models: ModelSets, tmp_path: Path) -> None:
    root = tmp_path / "data"
    _, manifest = run_one(root, small_study(TEXTURES), models, respondent=Stopping(1, after=2))
    with (
        SessionStore.resume(root, SessionManifest.load(manifest)),
        refused(InputError, got="running"),
    ):
        redact(root, tmp_path / "copy", sources=SOURCES, described={})
    log = next(root.glob("sourcedata/*/*/*_log.jsonl"))
    log.write_bytes(log.read_bytes().replace(b'"event"', b'"evemt"', 1))
    with refused(InputError, got="no event"):
        redact(root, tmp_path / "copy", sources=SOURCES, described={})


def test_a_presented_trial_renders_again_bit_for_bit(
    finished: Path, models: ModelSets, tmp_path: Path
) -> None:
    redact(finished, tmp_path / "copy", sources=SOURCES, described={})
    every = [model for of_set in models.sets.values() for model in of_set.values()]
    rendered = 0
    for table in sorted(finished.glob("sourcedata/*/*/*_presentations.tsv")):
        session = table.name.removesuffix("_presentations.tsv")
        header, *rows = (line.split("\t") for line in table.read_text().splitlines())
        hand = table.with_name(table.name.replace("presentations", "hand")).read_text()
        told = Counter((int(c[2]), c[0]) for c in map(str.split, hand.splitlines()[1:]))
        readings = {which for which, count in told.items() if count > 1}
        for cells in rows:
            row = dict(zip(header, cells, strict=True))
            if row["surface"] != "virtual":
                continue
            number = int(row["presentation"])
            stroked = (number, row["run"]) in readings
            if not stroked:
                with refused(InputError, expected="readings"):
                    render_presentation(finished, session, number, models=every)
                continue
            one = render_presentation(finished, session, number, models=every)
            again = render_presentation(tmp_path / "copy", session, number, models=every)
            assert one.tobytes() == again.tobytes()
            assert np.abs(one).max() > 0
            rendered += 1
    assert rendered > 5
    with refused(InputError, got="others"):
        render_presentation(finished, session, number, models=[])
    with refused(InputError, got="none"):
        render_presentation(finished, session, 999, models=every)


def test_what_lies_beside_a_session_is_not_its_own(
    finished: Path, models: ModelSets, tmp_path: Path
) -> None:
    """Notes beside a log, and what a link leads to, are no data; also of a session that was killed
    before its log could list its files."""
    root = Path(shutil.copytree(finished, tmp_path / "data"))
    log = next(root.glob("sourcedata/sub-01/*/*absolute_log.jsonl"))
    lines = log.read_bytes().splitlines(keepends=True)
    assert b'"stored"' in lines[-1]
    log.write_bytes(b"".join(lines[:-1]))
    notes = log.with_name(log.name.replace("log.jsonl", "notes.txt"))
    notes.write_text("Anna was tired")
    redacted = redact(root, tmp_path / "copy", sources=SOURCES, described={})
    assert "Anna" not in everything(tmp_path / "copy")
    files = {path for path in (tmp_path / "copy").rglob("*") if path.is_file()}
    assert redacted.files == files
    hand = log.with_name(log.name.replace("log.jsonl", "hand.tsv"))
    elsewhere = hand.rename(tmp_path / "elsewhere.tsv")
    hand.symlink_to(elsewhere)
    with refused(InputError, expected=hand, got=elsewhere):
        redact(root, tmp_path / "other", sources=SOURCES, described={})


def test_each_of_many_days_begins_at_noon(finished: Path) -> None:
    """However many sessions there were before."""
    (one, *_), _ = held_sessions(finished)
    first = datetime.fromisoformat(one.state.begun_utc)

    def on_day(day: int) -> StoredSession:
        events = [{**e, "utc": (first + timedelta(days=day)).isoformat()} for e in one.state.events]
        state = replace(one.state, events=tuple(events), begun_utc=events[0]["utc"])
        return replace(one, files=replace(one.files, session=day + 1), state=state)

    begins = dict(_beginnings([on_day(day) for day in range(100)]))
    assert list(begins.values()) == [BEGINNING + timedelta(days=day) for day in range(100)]
