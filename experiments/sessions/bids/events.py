"""What happened in a session, as a BIDS table of events: from its log and its presentations.

docs/method/protocols.md#bids
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from math import inf

from tactileq.experiments.sessions.kept.log import OWN_FIELDS, Event
from tactileq.experiments.sessions.kept.traces import PRESENTATION_COLUMNS
from tactileq.modeling.files.answer_tables import ENDS
from tactileq.modeling.files.columns import Column, names, without

# Two records of one presentation: the log's when a press was seen, and the rig's (s).
SAME_START_S = 1e-3

EVENT_MEANINGS = {
    "opened": "The session began or was resumed",
    "welcome": "The participant consented, confirmed the code and answered the questions",
    "phase": "A part of the session was announced",
    "mount_requested": "The experimenter was asked for the sample of a tray",
    "mount_confirmed": "The experimenter confirmed that it is mounted",
    "presented": "A surface was presented",
    "slider": "A slider was released",
    "chosen": "A virtual surface was chosen; the last one before the answer counts",
    "answer": "The trial was answered; the answer is in the table of answers",
    "training_over": "Training ended",
    "outside": "The participant was asked to stroke differently",
    "exposure": "The vibration of the trial was added to the exposure of the participant's day",
    "break_began": "A break began",
    "break_ended": "The participant ended the break",
    "stop_asked": "The participant asked to stop, and was asked whether to",
    "stop_withdrawn": "The participant decided to continue",
    "fault": "The rig or a part of it failed",
    "pen": "Acceleration at the pen was stored",
    "ended": "This start of the session ended",
    "stored": "The files beside the log were closed",
}
_OWN = (
    Column(
        "onset",
        unit="s",
        description="Since the session began",
        limits=(-inf, inf),
        required=True,
    ),
    Column(
        "duration",
        unit="s",
        description="From the first to the last sample of a presentation; n/a for events without "
        "duration",
        limits=(-inf, inf),
    ),
    Column("trial_type", description="What happened", required=True),
    Column(
        "run",
        description="In which start of the session, from 1",
        limits=(1, inf),
        whole=True,
        required=True,
    ),
    Column(
        "trial",
        description="Number of the trial; n/a outside trials",
        limits=(0, inf),
        whole=True,
    ),
    Column("phase", description="Part of the session that was announced"),
    Column("tray", description="Tray of the sample"),
    Column(
        "surface",
        description="What was presented",
        levels={"real": "the mounted real surface", "virtual": "a virtual surface"},
    ),
    Column(
        "button",
        description="Button of the virtual surface, from 1",
        limits=(1, inf),
        whole=True,
    ),
    Column("scale", description="Which slider"),
    Column(
        "value",
        unit="arbitrary",
        description="Where it was released, 0 to 100",
        limits=ENDS,
    ),
    Column(
        "status",
        description="How this start of the session ended",
        levels={
            "complete": "all trials were answered",
            "aborted": "somebody ended it",
            "crashed": "the program failed",
        },
    ),
    Column("by", description="Who or what ended it"),
    Column("told", description="What was reported: a fault, a reason, an advice"),
    Column(
        "invalidates",
        description="Whether the participant cannot have felt what was planned",
        levels={"true": "the trial is not valid", "false": "nothing follows"},
    ),
    Column(
        "start_s",
        unit="s",
        description="When the first sample was output, on the rig's clock",
        limits=(-inf, inf),
    ),
)
_FROM_PRESENTATIONS = without(
    PRESENTATION_COLUMNS, "run", "trial", "surface", "start_s", "end_s", "faults"
)
EVENT_COLUMNS = (*_OWN, *_FROM_PRESENTATIONS)
# Answers are in their own tables, the participants' in participants.tsv.
_ELSEWHERE = ("answers", "row", "manifest_sha256", "overrides", "changed", "cut", "files")
_KEPT = frozenset(names(_OWN)).difference(_ELSEWHERE, OWN_FIELDS)
_OF_A_PRESENTATION = names(_FROM_PRESENTATIONS)


def event_rows(
    events: Sequence[Event], presentations: Sequence[Mapping[str, str]]
) -> list[dict[str, object]]:
    """The rows of the table of events, in the order of their onsets.

    Parameters
    ----------
    events : sequence of dict
        Of the log.
    presentations : sequence of mapping
        The rows of the session's table of presentations, as text.
    """
    onsets = onsets_s(events)
    # By start of the session too: a trial that was interrupted is presented again in a later one,
    # whose rig has a clock of its own.
    shown: dict[tuple[str, str], list[Mapping[str, str]]] = {}
    for row in presentations:
        shown.setdefault((row["run"], row["trial"]), []).append(row)
    rows = [
        _row(event, onset, shown.get((str(event["run"]), str(event.get("trial"))), []))
        for event, onset in zip(events, onsets, strict=True)
    ]
    return sorted(rows, key=lambda row: float(str(row["onset"])))


def onsets_s(events: Sequence[Event]) -> list[float]:
    """When each event happened, in seconds since the first one (its run's clock, then UTC's).

    Within a run the monotonic clock counts; the start of a run is given by the date and time, but
    is never before the end of the last one.
    """
    onsets: list[float] = []
    began: dict[int, float] = {}
    for event in events:
        run = event["run"]
        if run not in began:
            latest = max(onsets, default=0.0)
            since = (_moment(event) - _moment(events[0])).total_seconds()
            began[run] = max(since if onsets else 0.0, latest) - event["t_s"]
        onsets.append(began[run] + event["t_s"])
    return onsets


def trial_types(rows: Sequence[Mapping[str, object]]) -> dict[str, str]:
    """Every kind of event that there is, with its meaning."""
    found = sorted({str(row["trial_type"]) for row in rows})
    return {name: EVENT_MEANINGS.get(name, "As in the log of the session") for name in found}


def _moment(event: Event) -> datetime:
    return datetime.fromisoformat(event["utc"])


def _row(event: Event, onset: float, of_trial: list[Mapping[str, str]]) -> dict[str, object]:
    kept = {k: v for k, v in event.items() if k in _KEPT and v is not None}
    index = event.get("index")
    return {
        **kept,
        **(_presentation(event, of_trial) if event["event"] == "presented" else {}),
        "onset": round(onset, 6),
        "trial_type": event["event"],
        "run": event["run"],
        "button": index + 1 if isinstance(index, int) else None,
        "told": event.get("told") or event.get("reason") or event.get("advice"),
    }


def _presentation(event: Event, of_trial: list[Mapping[str, str]]) -> dict[str, object]:
    """What the rig says of a presentation, where it was stored; taken from the trial's, each once.

    A simulated rig, whose clock stops between presses, starts several at one time.
    """
    start_s = event.get("start_s")
    if not isinstance(start_s, int | float):
        return {}
    for place, row in enumerate(of_trial):
        same_start = abs(float(row["start_s"]) - start_s) < SAME_START_S
        if same_start and row["surface"] == event.get("surface"):
            of_trial.pop(place)
            found: dict[str, object] = {name: row[name] for name in _OF_A_PRESENTATION}
            duration_s = float(row["end_s"]) - float(row["start_s"])
            return {**found, "duration": round(duration_s, 6)}
    return {}
