"""A session that is killed anywhere loses no answer, doubles none, and goes on in its order."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.log import line_of, read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.resume import Resumption, resumption
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.state import session_state
from tactileq.experiments.sessions.store.session_store import SessionStore
from tests.experiments.scripted import rated
from tests.experiments.sessions.store.enrolling import enrolled

ManifestOf = Callable[..., SessionManifest]
ROOT = Path(__file__).parents[4]
PLANNED = [1, 2, 3, 4]


def run(*arguments: object) -> str:
    """What the script prints."""
    script = Path(__file__).with_name("killed_session.py")
    ended = subprocess.run(
        [sys.executable, str(script), *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=500,
        check=True,
        capture_output=True,
        text=True,
    )
    assert ended.stderr == ""
    return ended.stdout


def files_in(folder: Path) -> SessionFiles:
    return SessionFiles(root=folder, task="absolute", subject=1, session=1)


def small(manifest_of: ManifestOf) -> SessionManifest:
    """The session that the script runs."""
    phases = ["training", "main", "main", "main"]
    return manifest_of(
        study={"name": "Small"},
        trials=[{"trial": n, "phase": phase} for n, phase in enumerate(phases, start=1)],
    )


def told(folder: Path) -> list[list[str]]:
    path = folder.with_name(f"{folder.name}.told")
    return [line.split() for line in path.read_text().splitlines()]


def answer_rest(store: SessionStore, manifest: SessionManifest) -> Resumption:
    left = resumption(manifest, store.before, longest_gap_min=30)
    for trial in left.next_trials:
        number = trial["trial"]
        store.answer(number, rated(number, magnitude_similarity=10.0 * number))
    store.finish("complete")
    return left


def check_and_go_on(folder: Path, manifest: SessionManifest, safe: list[int]) -> str:
    """What must hold of a session that was killed, now and once it is finished; how it stood."""
    files = files_in(folder)
    if not files.manifest.exists():
        assert not safe
        enrolled(Roster(folder), 1, 4)
        with SessionStore.create(folder, manifest) as store:
            answer_rest(store, manifest)
        status = "never begun"
    else:
        before = files.manifest.read_bytes()
        state = session_state(files.log)
        status = state.status
        assert status in ("crashed", "complete")
        kept = [row["trial"] for row in state.rows]
        assert kept == PLANNED[: len(kept)]
        # The one answer more is that which was on disk when its writer was killed.
        assert len(safe) <= len(kept) <= len(safe) + 1
        if status == "complete":
            assert kept == PLANNED
        else:
            go_on(folder, manifest, kept)
        assert files.manifest.read_bytes() == before
    assert_whole(files)
    return status


def go_on(folder: Path, manifest: SessionManifest, kept: list[int]) -> None:
    files = files_in(folder)
    there = files.log.read_bytes() if files.log.exists() else b""
    with SessionStore.resume(folder, manifest) as store:
        left = answer_rest(store, manifest)
    assert [trial["trial"] for trial in left.next_trials] == PLANNED[len(kept) :]
    # Whatever had happened stays on record, presentations of the unanswered trial included.
    assert files.log.read_bytes().startswith(there[: there.rfind(b"\n") + 1])
    assert not session_state(files.log).cut


def assert_whole(files: SessionFiles) -> None:
    state = session_state(files.log)
    assert state.status == "complete"
    assert [(row["trial"], row["magnitude_similarity"]) for row in state.rows] == [
        (number, 10.0 * number) for number in PLANNED
    ]
    for name in ("hand.tsv", "presentations.tsv"):
        header, *rows = files.named(name).read_bytes().split(b"\n")[:-1]
        assert {row.count(b"\t") for row in rows} <= {header.count(b"\t")}
    assert not list(files.root.rglob("*.unfinished"))
    assert Roster(files.root).subjects()[1]["slot"] == 1


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sessions that were killed before, or in, every call that changed the disk."""
    root = tmp_path_factory.mktemp("killed")
    ended = json.loads(run("kill", root))
    # Before the last of the calls each of them was killed; with one more than all, none.
    assert sorted(ended.values()) == [-signal.SIGKILL] * (len(ended) - 2) + [0, 0]
    assert len(ended) > 60
    return root


def folders(root: Path) -> list[Path]:
    return [path.with_suffix("") for path in sorted(root.glob("*.told"))]


def test_killed_anywhere(killed: Path, manifest_of: ManifestOf, tmp_path: Path) -> None:
    statuses = []
    for folder in folders(killed):
        safe = [int(word[1]) for word in told(folder) if word[0] == "answer"]
        copy = tmp_path / folder.name
        if folder.exists():
            shutil.copytree(folder, copy)
        statuses.append(check_and_go_on(copy, small(manifest_of), safe))
    assert set(statuses) == {"never begun", "crashed", "complete"}
    assert statuses.count("crashed") > 30


def test_without_power_what_was_safe_is_there(
    killed: Path, manifest_of: ManifestOf, tmp_path: Path
) -> None:
    """As if each log had lost all that was not forced to disk, and got zeros at its end."""
    checked = 0
    for number, folder in enumerate(folders(killed)):
        log = files_in(tmp_path / folder.name).log
        if not files_in(folder).log.exists():
            continue
        shutil.copytree(folder, tmp_path / folder.name)
        sizes = [int(word[1]) for word in told(folder) if word[0] == "safe" and word[2] == log.name]
        safe = [int(word[1]) for word in told(folder) if word[0] == "answer"]
        forced = log.read_bytes()[: max(sizes, default=0)]
        log.write_bytes(forced + bytes(number % 3 * 40))
        check_and_go_on(tmp_path / folder.name, small(manifest_of), safe)
        checked += bool(safe)
    assert checked > 20


def test_killed_anywhere_while_it_is_resumed(tmp_path: Path, manifest_of: ManifestOf) -> None:
    begun, root = tmp_path / "begun", tmp_path / "killed"
    root.mkdir()
    manifest = small(manifest_of)
    enrolled(Roster(begun), 1, 4)
    with SessionStore.create(begun, manifest) as store:
        for number in (1, 2):
            store.answer(number, rated(number, magnitude_similarity=10.0 * number))
    log = files_in(begun).log
    log.write_bytes(log.read_bytes() + line_of({"n": 4, "utc": "2026"})[:-5])
    run("kill", root, begun)
    for folder in folders(root):
        safe = [1, 2] + [int(word[1]) for word in told(folder) if word[0] == "answer"]
        check_and_go_on(folder, manifest, safe)
    assert len(folders(root)) > 30


def test_eight_consoles_at_once(tmp_path: Path) -> None:
    run("race", tmp_path)
    outcomes = [path.read_text().strip() for path in sorted(tmp_path.glob("*.told"))]
    assert len(outcomes) == 8
    for subject in (1, 2):
        mine = outcomes[subject - 1 :: 2]
        assert mine.count("ran") == 1
        refusals = [outcome for outcome in mine if outcome != "ran"]
        assert all("expected a session that has not been run" in text for text in refusals)
        assert not any("\n" in text for text in refusals)
        files = SessionFiles(root=tmp_path / "data", task="absolute", subject=subject, session=1)
        events = read_log(files.log).events
        assert [event["event"] for event in events] == ["opened", "answer", "ended", "stored"]
    assert sorted(Roster(tmp_path / "data").subjects()) == [1, 2]
