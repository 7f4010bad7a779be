"""The tables of a data set about people: who took part, in which sessions.

docs/method/protocols.md#bids
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import datetime
from math import inf
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.bids.tables import cell, json_bytes, table_bytes
from tactileq.experiments.sessions.kept.stored_sessions import StoredSession
from tactileq.experiments.study.questions import NOT_SAID
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, PARTICIPANT_COLUMNS, PARTICIPANT_ID
from tactileq.modeling.files.columns import Column, sidecar

# In the description of a data set: whether its source data identify nobody any more.
REDACTED = "Redacted"
STATUS_LEVELS = {
    "complete": "all trials were answered",
    "aborted": "somebody ended it; it can be resumed",
    "crashed": "the program was killed or failed; it can be resumed",
    "running": "it was running when this table was written",
}
SESSION_COLUMNS = (
    Column("session_id", description="Session (day)", required=True),
    Column(
        "day",
        unit="day",
        description="Whole days since the participant's first session; the dates themselves are "
        "left out, since they may identify the person",
        limits=(0, inf),
        whole=True,
        required=True,
    ),
    *(
        Column(
            task,
            description=f"State of the session of the task {task} stands",
            levels=STATUS_LEVELS,
        )
        for task in ANSWER_TABLES
    ),
)


def people_files(
    root: Path,
    sessions: Sequence[StoredSession],
    roster: Mapping[int, Mapping[str, Any]],
    *,
    rows_kept: Collection[str] = (),
    kept: Collection[str] = (),
) -> dict[Path, bytes]:
    """participants.tsv and each one's sessions.tsv, with their sidecars.

    Parameters
    ----------
    root : Path
        Of the data set.
    sessions : sequence of StoredSession
        By subject, session and task.
    roster : mapping of subject to mapping
        As `Roster.subjects` gives it.
    rows_kept : collection of str
        Participants whose row stays as it is there, since its source is damaged.
    kept : collection of str
        Participants whose sessions.tsv is left alone for that reason.
    """
    by_person: dict[str, list[StoredSession]] = {}
    for held in sessions:
        by_person.setdefault(held.files.participant, []).append(held)
    columns = (PARTICIPANT_ID, *_questions(sessions), *PARTICIPANT_COLUMNS)
    table = root / "participants.tsv"
    header, *lines = table_bytes(
        columns, (_person(name, of_one, roster) for name, of_one in by_person.items())
    ).splitlines(keepends=True)
    made = dict(zip(by_person, lines, strict=True))
    first, there = _rows_there(table)
    files = {}
    # Rows that are kept cannot stand below other columns.
    if first == header or not there.keys() & set(rows_kept):
        made |= {name: there[name] for name in rows_kept if name in there}
        files[table] = header + b"".join(made[name] for name in sorted(made))
        files[table.with_suffix(".json")] = json_bytes(sidecar(columns))
    for name, of_one in by_person.items():
        if name not in kept:
            own = root / name / f"{name}_sessions.tsv"
            files[own] = table_bytes(SESSION_COLUMNS, _session_rows(of_one))
            files[own.with_suffix(".json")] = json_bytes(sidecar(SESSION_COLUMNS))
    return files


def people_there(table: Path) -> set[str]:
    """Who has a row in a table of people, as sub-01."""
    return set(_rows_there(table)[1])


def _rows_there(table: Path) -> tuple[bytes, dict[str, bytes]]:
    """The header of a table of people, and its rows by participant; nothing where there is none."""
    if not table.is_file():
        return b"", {}
    header, *rows = table.read_bytes().splitlines(keepends=True) or [b""]
    return header, {row.split(b"\t", 1)[0].decode("utf-8", "replace"): row for row in rows}


def _questions(sessions: Iterable[StoredSession]) -> Iterable[Column]:
    """The columns of what was asked, in the order of the study."""
    declined = {
        name for held in sessions for name, said in _answers(held).items() if said == NOT_SAID
    }
    columns: dict[str, Column] = {}
    for held in sessions:
        for question in held.manifest.study.get("questions", ()):
            name = question["name"]
            columns.setdefault(name, _question(question, declined=name in declined))
    return columns.values()


def _question(question: Mapping[str, Any], *, declined: bool) -> Column:
    """The column of a question; that somebody left it unanswered is described where it happened.

    A choice has a level for that. A number, of which a column holds nothing else, is n/a then.
    """
    name, levels = question["name"], question.get("levels", ())
    english = question.get("levels_text", {}).get("en", levels)
    description = question.get("text", {}).get("en", name.replace("_", " "))
    if declined and not levels:
        description += "; n/a of whoever preferred not to say"
    elif declined and NOT_SAID not in levels:
        levels, english = [*levels, NOT_SAID], [*english, "preferred not to say"]
    return Column(
        name,
        unit="year" if name == "age" else "",
        description=description,
        # As they stand in cells: validators compare these with them, quotes and all.
        levels=dict(zip(map(cell, levels), english, strict=True)) if levels else {},
    )


def _answers(held: StoredSession) -> dict[str, object]:
    """What a participant answered to the questions in a session."""
    answers: dict[str, object] = {}
    for event in held.state.events:
        if event["event"] == "welcome":
            answers |= event.get("answers") or {}
    return answers


def _person(
    name: str, sessions: Sequence[StoredSession], roster: Mapping[int, Mapping[str, Any]]
) -> dict[str, object]:
    first = sessions[0].manifest
    answers: dict[str, object] = {}
    consent = ""
    for held in sessions:
        numbers = {q["name"] for q in held.manifest.study.get("questions", ()) if "least" in q}
        for question, said in _answers(held).items():
            answers[question] = None if said == NOT_SAID and question in numbers else said
        for event in held.state.events:
            if event["event"] == "welcome":
                consent = event.get("consent") or consent
    listed = roster.get(first.subject, {})
    return {
        **answers,
        "participant_id": name,
        "slot": first.slot,
        "status": "dropped" if listed.get("left") == "dropped" else "enrolled",
        "consent_version": consent,
        "language": first.language,
        "pilot": first.pilot,
        "simulated": first.simulated_participant,
    }


def _session_rows(sessions: Sequence[StoredSession]) -> list[dict[str, object]]:
    days = {s.files.session_id: datetime.fromisoformat(s.state.begun_utc).date() for s in sessions}
    first = min(days.values())
    rows: dict[str, dict[str, object]] = {}
    for held in sessions:
        session = held.files.session_id
        row = rows.setdefault(session, {"session_id": session})
        row["day"] = (days[session] - first).days
        row[held.manifest.task] = held.state.status
    return [rows[session] for session in sorted(rows)]


def readme(description: Mapping[str, Any]) -> bytes:
    """The README of the data set; that of a copy which is `REDACTED` is read by others."""
    # Where studies run, the text stays as it is: data sets are compared with it, byte by byte.
    closing = (
        "Cells hold values as they are: let a spreadsheet import all columns as text, or it "
        "calculates some.\n\nsourcedata holds no pseudonyms, dates or times of day; tactileq "
        "verify needs it."
        if description.get(REDACTED)
        else "sourcedata holds pseudonyms, dates and times: leave it out of what you publish."
    )
    simulated = (
        "\nTHESE DATA ARE SIMULATED: dataset_description.json says which parts.\n"
        if description.get("Simulated")
        else ""
    )
    texts = (
        "sourcedata/texts_*         what participants read, by language\n"
        if description.get("TextsSHA256")
        else ""
    )
    return f"""{description.get("Name", "")}
{simulated}
Answers of a study with tactileq, as a BIDS data set.

participants.tsv           who took part
sub-XX/sub-XX_sessions.tsv the person's sessions, and how each one ended
sub-XX/ses-XX/beh/         of each session
  *_beh.tsv                the answers, one row for each trial, in the order in which they were
  given
  *_events.tsv             what happened: presentations and what limits did to them, breaks, faults
  *_physio.tsv.gz          the hand, 250 times a second; a file for each start of the session
sourcedata/                what the program wrote during sessions; all of the above is generated
from it
{texts}
Every column is described in the JSON file beside its table. n/a means that there is no value. Text
with quotes is written as in CSV; control characters are replaced by their symbols.

{closing}
""".encode()
