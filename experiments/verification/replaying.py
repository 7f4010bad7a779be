"""A session's log replayed through its task: does each answer follow from what was done?

docs/method/verification.md#replay
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

from tactileq.experiments.sessions.kept.log import Event, plain
from tactileq.experiments.sessions.kept.resume import resumption
from tactileq.experiments.sessions.kept.stored_sessions import StoredSession
from tactileq.experiments.sessions.loop.people import Choice, Rating, Respondent
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import Trial
from tactileq.modeling.errors import InputError, shown
from tactileq.rig.shared.interface import TextureRig

NEAR = 0.05 + 1e-9  # of a rating: the log rounds where a slider was released to 0.1
RELATIVE_ERROR = 1e-6  # of what an adaptive task computes, on another machine
# By how much the time of an answer may miss what the log's clock says, in s: a rig says when the
# first sample leaves, the log when the surface was asked for; after the answer the rig falls silent
# before it is logged.
EARLY_S, LATE_S = 1.0, 10.0
Contradiction = tuple[int | None, str]


def contradictions(held: StoredSession, task: Task) -> Iterator[Contradiction]:
    """What in the log of a session contradicts the rest of it or its manifest.

    Yields
    ------
    (int or None, str)
        The number of the trial, where it is in one, and a sentence.
    """
    yield from _clock(held.state.events)
    planned = {values["trial"]: values for values in held.manifest.trials}
    before: list[Mapping[str, Any]] = []
    attempt: dict[int, list[Event]] = {}
    for event in held.state.events:
        number = event.get("trial")
        if event["event"] == "opened":
            attempt = {}  # what was presented in a trial that was interrupted comes again
        elif event["event"] == "answer":
            row, seen = event["row"], attempt.pop(cast(int, number), [])
            for sentence in _of_answer(row, event, seen, planned, before, held=held, task=task):
                yield number, sentence
            before.append(row)
        elif isinstance(number, int):
            attempt.setdefault(number, []).append(event)
    yield from _end(held)


def _clock(events: Sequence[Event]) -> Iterator[Contradiction]:
    for one, following in pairwise(events):
        if one["run"] == following["run"] and following["t_s"] < one["t_s"]:
            yield (
                following.get("trial"),
                f"expected line {following['n']} not before line {one['n']}, at {one['t_s']:g} s, "
                f"got {following['t_s']:g} s",
            )


def _end(held: StoredSession) -> Iterator[Contradiction]:
    """A complete session has an answer to each main trial, and one again where the rig failed."""
    if held.state.status != "complete":
        return
    left = resumption(held.manifest, held.state, longest_gap_min=float("inf"))
    for trial in (*left.next_trials, *left.to_repeat):
        if trial["phase"] == "main":
            yield trial["trial"], "expected a valid answer in a complete session, got none"


def _of_answer(
    row: Mapping[str, Any],
    event: Event,
    seen: Sequence[Event],
    planned: Mapping[int, Mapping[str, Any]],
    before: Sequence[Mapping[str, Any]],
    *,
    held: StoredSession,
    task: Task,
) -> Iterator[str]:
    again = row.get("repeats")
    values = planned.get(row["trial"] if again is None else again)
    if values is None:
        yield f"expected a planned trial, got {shown(again or row['trial'])}"
        return
    surfaces = _SeenSurfaces(seen)
    answering = _Recorded(seen, row, says_choices=_says_choices(held, event["run"]))
    try:
        trial = task.trial_of({**values, "trial": event["trial"]})
        if task.adapt is not None:
            trial = task.adapt(trial, before, cast(TextureRig, _Limit(row)))
        own = task.ask(cast(Respondent, answering), trial, cast(Surfaces, surfaces))
    except (InputError, LookupError, TypeError, ValueError) as error:
        yield f"expected an answer that follows from the log, got {error}"
        return
    yield from surfaces.contradictions(task, trial)
    yield from _times(held, row, event, seen)
    wanted = {
        "trial": event["trial"],
        **{name: values[name] for name in ("phase", "texture", "model", "tray")},
        **own,
        "run": event["run"],
        "valid": int(not surfaces.failed),
        "repeats": again,
        "pilot": held.manifest.pilot,
        "simulated": held.manifest.simulated,
    }
    for name in {**wanted, **row}:
        expected, got = plain(wanted.get(name)), row.get(name)
        if not _same(expected, got):
            yield f"expected {name} {shown(expected)}, as the log says, got {shown(got)}"


def _says_choices(held: StoredSession, run: int) -> bool:
    """Whether what was chosen stands in the log of a start of the session.

    It does not where an early version ran it, before logs had seals: what was felt last was chosen.
    """
    of_run = (event for event in held.state.events if event["run"] == run)
    return held.manifest.after is not None or any(e["event"] == "chosen" for e in of_run)


def _times(
    held: StoredSession, row: Mapping[str, Any], event: Event, seen: Sequence[Event]
) -> Iterator[str]:
    """A person's response time fits the clock of the log; a simulated one is drawn."""
    first = next((e for e in seen if e["event"] == "presented"), None)
    said = row.get("response_time_s")
    if first is None or said is None or held.manifest.simulated_participant:
        return
    passed = event["t_s"] - first["t_s"]
    if not passed - LATE_S <= said <= passed + EARLY_S:
        yield f"expected response_time_s about {passed:.3f}, by the log's clock, got {shown(said)}"


def _same(expected: object, got: object) -> bool:
    if isinstance(expected, float) and isinstance(got, int | float):
        return abs(expected - got) <= RELATIVE_ERROR * abs(expected)
    return expected == got


class _Recorded:
    """Answers a trial as somebody did, according to the log."""

    def __init__(
        self, seen: Sequence[Event], row: Mapping[str, Any], *, says_choices: bool
    ) -> None:
        self._seen, self._row, self._says_choices = seen, row, says_choices

    def rate(self, trial: Trial, surfaces: Surfaces) -> Rating:
        """Where the sliders were released last."""
        last = {e["scale"]: e["value"] for e in self._seen if e["event"] == "slider"}
        ratings: dict[str, Any] = {}
        for scale in ("magnitude", "frequency"):
            name = f"{scale}_similarity"
            if scale not in last:
                raise ValueError(f"no slider of {scale}")
            stored = self._row.get(name)
            near = isinstance(stored, int | float) and abs(stored - last[scale]) <= NEAR
            ratings[name] = stored if near else last[scale]
        return Rating(response_time_s=self._row["response_time_s"], **ratings)

    def choose(self, trial: Trial, surfaces: Surfaces) -> Choice:
        """What was chosen last."""
        chosen = [e["index"] for e in self._seen if e["event"] == "chosen"]
        if not self._says_choices:
            chosen = self._felt(surfaces)
        if not chosen:
            raise ValueError("nothing that was chosen")
        return Choice(button=chosen[-1], response_time_s=self._row["response_time_s"])

    def _felt(self, surfaces: Surfaces) -> list[int]:
        """The surface felt last; of two intervals, which are felt once, also the one answered."""
        felt = [] if surfaces.last is None else [surfaces.last]
        answered = self._row.get("answer")
        if "interval" in self._row and isinstance(answered, int) and answered - 1 in surfaces.felt:
            felt.append(answered - 1)
        return felt


class _Limit:
    """A rig that can do what the answer says it could."""

    def __init__(self, row: Mapping[str, Any]) -> None:
        self._row = row

    def strongest_g(self, burst: object) -> float:
        return float(self._row["highest_g"])


class _SeenSurfaces:
    """What was presented in a trial, according to the log; counted as `Surfaces` does."""

    def __init__(self, seen: Sequence[Event]) -> None:
        self._seen = seen
        self.started, self.feel_all = True, False
        self.switches = self.presses = 0
        self.felt: set[int] = set()
        self.failed = False
        self.last: int | None = None
        self.chosen: int | None = None
        shows, resumed, presented = "", False, False
        for event in seen:
            name = event["event"]
            if name == "presented" and not resumed:
                presented = True
                self.switches += shows not in ("", event["surface"])
                shows = event["surface"]
                if shows == "virtual":
                    self.presses += 1
                    self.last = event["index"]
                    self.felt.add(event["index"])
            elif name == "fault" and presented:
                self.failed = self.failed or bool(event.get("invalidates"))
            elif name == "chosen":
                self.chosen = event["index"]
            # Whoever was asked whether to stop feels again what was presented before.
            resumed = name == "stop_withdrawn"

    def contradictions(self, task: Task, trial: Trial) -> Iterator[str]:
        """What was presented that was not planned."""
        first = next((e for e in self._seen if e["event"] == "presented"), None)
        begun = _Begun()
        task.begin(trial, cast(Surfaces, begun))
        if begun.wanted and (first is None or begun.wanted != _which(first)):
            got = "nothing" if first is None else " ".join(map(str, _which(first)))
            yield f"expected {' '.join(map(str, begun.wanted))} presented first, got {got}"
        for event in self._seen:
            if event["event"] == "chosen" and event["index"] not in self.felt:
                yield f"expected a choice of a surface that was felt, got {event['index']}"
            if event["event"].startswith("mount_") and event.get("tray") != trial.tray:
                yield f"expected tray {trial.tray} to be mounted, got {shown(event.get('tray'))}"


class _Begun:
    """Surfaces that note what a task presents first."""

    def __init__(self) -> None:
        self.wanted: tuple[object, ...] = ()

    def present_real(self) -> None:
        self.wanted = self.wanted or ("real",)

    def present_virtual(self, index: int = 0) -> None:
        self.wanted = self.wanted or ("virtual", index)


def _which(event: Event) -> tuple[object, ...]:
    return ("real",) if event["surface"] == "real" else ("virtual", event.get("index"))
