"""Each command that writes, ended after each call that changes a disk; then the next one goes on.

A run is recorded once, then replayed in a process of its own for each call and each signal. What a
command writes into a hidden folder nobody else sees before it is moved: of many calls in there some
are tried, the first and the last among them. Commands that need a device on a wire are not here.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from tactileq import app
from tactileq.experiments.sessions.bids.export import export_all
from tactileq.experiments.sessions.kept.files import SessionFiles, sessions_in
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.stored_sessions import held_session
from tactileq.experiments.sessions.store.withdrawing import withdraw
from tactileq.experiments.verification.verifying import verify_data
from tactileq.modeling.files.places import LOCK_NAME
from tests.end_to_end.conftest import commands
from tests.end_to_end.test_inputs import COMMANDS, here
from tests.experiments.verification.small_studies import (
    Stopping,
    run_all,
    run_one,
    small_models,
    small_study,
)
from tests.interrupting import Interrupter, forked

__all__ = ["here"]

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
NAMES = tuple(number.name for number in SIGNALS)
MOST_HIDDEN = 6  # of the calls in a hidden folder
SAMPLE = 4  # in make test, of each signal
# What is already tried by another command of the same kind, but for what it reads, or as a session.
_ALIKE = {
    *("simulate", "a picture of recordings", "scene of a recorded hand", "stimuli of a scene"),
    *("stimuli of a model", "simulate a scene", "simulate a scene of other models"),
    *("chart of recordings", "import csv"),
}
WRITERS: dict[str, tuple[object, ...]] = {
    **{name: words for name, words in COMMANDS.items() if name not in _ALIKE},
    "record": ("record", "new", "--texture", "canvas", "--rate", 5000, "--seed", 1),
    "model": ("model", "wet/canvas"),
    "study init": ("study", "init", "new.toml"),
    "study status": ("study", "status", "--data", "taken"),
    "study dropout": ("study", "dropout", 1, "--data", "taken", "--yes"),
    "study withdraw": ("study", "withdraw", 1, "--data", "taken", "--yes"),
}
# In make test, beside sessions.
SAMPLED = ("header", "study withdraw")
_RANDOM = re.compile(r"\.[0-9a-f]{8}\.unfinished")


def taken(folder: Path) -> Path:
    """A data set of two people, of whose first the tables are missing."""
    run_all(folder / "taken", small_study(("canvas", "PVC")), small_models(("canvas", "PVC")))
    shutil.rmtree(folder / "taken/sub-01")
    return folder


# --- Running --------------------------------------------------------------------------------------


class Swept:
    """What is run in copies of a folder: whole, and ended after one of its calls.

    Parameters
    ----------
    before : Path
        What is there at first.
    work : callable
        Done in a copy, as a process of its own; its exit code.
    """

    def __init__(self, before: Path, scratch: Path, work: Callable[[], int]) -> None:
        self._before, self._scratch, self._work = before, scratch, work
        self.place = scratch / "place"

    def restore(self) -> None:
        """A new copy, in which only data that grow are files of their own: that is quicker."""
        shutil.rmtree(self.place, ignore_errors=True)
        shutil.copytree(self._before, self.place, copy_function=_copy)

    def load(self) -> None:
        """Do it once in this process, so that no other one loads for itself what it needs."""
        self.restore()
        with chdir(self.place), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            assert self._work() == 0

    def run(self, work: Callable[[], int] | None = None, **at: Any) -> tuple[int, str, list[str]]:
        """Exit code, what was told, and the calls."""
        told, calls = self._scratch / "told", self._scratch / "calls"
        calls.unlink(missing_ok=True)

        def child() -> int:
            os.chdir(self.place)
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            sys.stdout = sys.stderr = told.open("w", encoding="utf-8", buffering=1)
            interrupter = Interrupter(self.place, **at)
            try:
                return (work or self._work)()
            finally:
                calls.write_text("\n".join(interrupter.calls))

        code = forked(child)
        return code, told.read_text(), calls.read_text().split("\n") if calls.exists() else []


def _copy(source: str, target: str) -> None:
    (shutil.copyfile if "sourcedata" in source else os.link)(source, target)


def command(words: Sequence[object]) -> int:
    """Run the command line; its exit code."""
    sys.argv = ["tactileq", *map(str, words)]
    sys.argv += ["--jobs", "1"] if words[0] == "model" else []
    try:
        app.main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def contents(folder: Path) -> dict[str, bytes]:
    """All finished files of a folder; those of nobody's interest, locks, are left out."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.parts)
    }


def hidden(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob(".*")]


def moments(calls: Sequence[str]) -> list[int]:
    """After which calls a run is ended: all that others can see, see MOST_HIDDEN."""
    inside = [n for n, call in enumerate(calls, 1) if ".unfinished/" in call]
    outside = [n for n in range(1, len(calls) + 1) if n not in set(inside)]
    return sorted({*evenly(inside, MOST_HIDDEN), *outside})


def evenly(places: Sequence[int], most: int) -> list[int]:
    """As many of these, the first and the last among them."""
    if len(places) <= most:
        return list(places)
    return [places[round(n * (len(places) - 1) / (most - 1))] for n in range(most)]


def sweep(
    swept: Swept,
    *,
    most: int | None = None,
    go_on: Callable[[], int] | None = None,
    continues: bool = False,
) -> dict[str, int]:
    """End it at each moment, and let the next one go on; how often, by signal.

    Then there are all files that an undisturbed run leaves, with the same bytes where those of two
    undisturbed runs are the same.

    Parameters
    ----------
    most : int, optional
        Of the moments of each signal.
    go_on : callable, optional
        What is done next, if it is not the same again.
    continues : bool
        Whether what is there already stays, so that the rest is of another run, with other bytes.
    """
    swept.load()
    ends = []
    for _ in range(2):
        swept.restore()
        code, told, calls = swept.run()
        assert code == 0, told
        ends.append(contents(swept.place))
    swept.restore()
    # The provenance of what is added to may name the run that was ended, too.
    fixed = {
        name: data
        for name, data in ends[0].items()
        if ends[1].get(name) == data and not (continues or name.endswith("provenance.json"))
    }

    def differing(place: Path) -> set[str]:
        found = contents(place)
        changed = {n for n, data in fixed.items() if n in found and found[n] != data}
        return found.keys() ^ ends[0].keys() | changed

    known: set[int] = set()
    chosen = moments(calls) if most is None else evenly(moments(calls), most)
    for number, where, code, told in ended(swept, calls, chosen):
        assert code in (0, -number, 128 + number), f"{where}: {told}"
        if number != signal.SIGKILL:
            assert not hidden(swept.place), where
        state = state_of(swept.place)
        if state in known:  # the next one cannot tell
            continue
        known.add(state)
        done = not differing(swept.place)
        code, told, _ = swept.run(go_on)
        assert code == 0 or done, f"{where}, then: {told}"  # some refuse what is done already
        # A lock that was left by who was killed is taken over by who next needs it, and what was
        # not finished is cleared by who next writes there.
        left = [name for name in hidden(swept.place) if not name.endswith(LOCK_NAME)]
        assert done or not left, where
        assert not differing(swept.place), where
    return dict.fromkeys(NAMES, len(chosen))


def ended(
    swept: Swept, calls: Sequence[str], places: Sequence[int]
) -> Iterator[tuple[int, str, int, str]]:
    """A run ended by each signal after each call: signal, where, exit code, what was told."""
    for number, name in zip(SIGNALS, NAMES, strict=True):
        for at in places:
            swept.restore()
            code, told, _ = swept.run(at=at, number=number)
            yield number, f"{name} after {at} of {len(calls)}: {calls[at - 1]}", code, told


def state_of(place: Path) -> int:
    """All names and bytes of a folder, but for random parts of hidden names."""
    return hash(
        tuple(
            sorted(
                (
                    _RANDOM.sub(".unfinished", path.relative_to(place).as_posix()),
                    path.read_bytes() if path.is_file() else b"",
                )
                for path in place.rglob("*")
            )
        )
    )


# --- Commands -------------------------------------------------------------------------------------


@pytest.fixture
def swept_command(
    request: pytest.FixtureRequest,
    here: Path,
    once_per_run: Any,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
    undrawn: None,
) -> Swept:
    shutil.copytree(once_per_run("data-of-two", taken) / "taken", here / "taken")
    monkeypatch.setattr(app, "app", commands())
    words = WRITERS[request.param]
    return Swept(here, tmp_path_factory.mktemp("swept"), partial(command, words))


def go_on_of(name: str) -> Callable[[], int] | None:
    """What is done next where the same again is refused, as it then says."""
    if name in ("study dropout", "study withdraw"):
        return partial(again_or_refused, WRITERS[name])
    return None


def again_or_refused(words: Sequence[object]) -> int:
    """The same again, which is refused where it was done already; tables are made by the status."""
    command(words)
    return command(WRITERS["study status"])


@pytest.mark.parametrize("swept_command", SAMPLED, indirect=True)
def test_a_command_that_is_ended_at_some_calls_goes_on(
    swept_command: Swept, request: pytest.FixtureRequest
) -> None:
    name = request.node.callspec.params["swept_command"]
    tried = sweep(swept_command, most=SAMPLE, go_on=go_on_of(name))
    assert set(tried.values()) == {SAMPLE}


@pytest.mark.long("every command that writes, ended after each call")
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("swept_command", WRITERS, indirect=True)
def test_a_command_that_is_ended_at_any_call_goes_on(
    swept_command: Swept, request: pytest.FixtureRequest
) -> None:
    name = request.node.callspec.params["swept_command"]
    continues = name == "record on a recorder"
    print(name, sweep(swept_command, go_on=go_on_of(name), continues=continues))


# --- Sessions -------------------------------------------------------------------------------------

TEXTURES = ("canvas", "PVC")
FIRST = SessionFiles(root=Path("data"), task="absolute", subject=1, session=1)


def session(*, resume: bool) -> int:
    """One session of two people's study in the folder where this runs."""
    run_one(Path("data"), small_study(TEXTURES), MODELS, resume=resume)
    return 0


MODELS = small_models(TEXTURES)


def go_on_with_the_session() -> int:
    """The one that was ended, then somebody new, who withdraws; all is as it was stored."""
    export_all("data") if Path("data").exists() else None
    begun = FIRST.manifest.exists()
    if not begun or held_session(FIRST).state.status != "complete":
        session(resume=begun)
    run_one(Path("data"), small_study(TEXTURES), MODELS, subject=2)
    withdraw("data", 2)
    found = verify_data("data")
    assert found.differences == (), found.differences
    assert [files.stem for files in sessions_in("data")] == [FIRST.stem]
    assert Roster("data").listed().damaged == ""
    return 0


def opening(calls: Sequence[str]) -> int:
    """The call by which the first line of a session's log is on disk."""
    name = f"fsync data/{FIRST.log.relative_to('data')}"
    return calls.index(name) + 1


def sweep_session(tmp_path: Path, *, resume: bool, most: int | None = None) -> dict[str, int]:
    before = tmp_path / "before"
    before.mkdir()
    if resume:
        tired = Stopping(1, after=2)
        run_one(before / "data", small_study(TEXTURES), MODELS, respondent=tired)
    swept = Swept(before, tmp_path, partial(session, resume=resume))
    swept.load()
    swept.restore()
    code, told, calls = swept.run()
    assert code == 0, told
    # Most of what can go wrong does while it opens.
    places = range(1, (len(calls) if most is None else opening(calls)) + 1)
    chosen = places if most is None else evenly(places, most)
    for _, where, _, _ in ended(swept, calls, chosen):
        code, told, _ = swept.run(go_on_with_the_session)
        assert code == 0, f"{where}, then: {told}"
    return dict.fromkeys(NAMES, len(chosen))


@pytest.mark.parametrize("resume", [False, True])
def test_a_session_that_is_ended_at_some_calls_goes_on(tmp_path: Path, *, resume: bool) -> None:
    tried = sweep_session(tmp_path, resume=resume, most=SAMPLE)
    assert set(tried.values()) == {SAMPLE}


@pytest.mark.long("a session that is ended after each call")
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("resume", [False, True])
def test_a_session_that_is_ended_at_any_call_goes_on(tmp_path: Path, *, resume: bool) -> None:
    print("session", sweep_session(tmp_path, resume=resume))
