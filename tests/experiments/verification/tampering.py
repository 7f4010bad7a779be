"""Kinds of tampering with the data of a study that has ended.

The list was committed before it was first run (docs/method/verification.md#tampering). Each kind
changes the data of `small_studies.run_all`: two people, sessions absolute and relative, in this
order: 1 absolute, 2 absolute, 1 relative, 2 relative.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.bids.export import export_all
from tactileq.experiments.sessions.kept.log import line_of
from tests.experiments.sealing import sealed

FIRST = "sub-01_ses-01_task-absolute"
SECOND = "sub-02_ses-01_task-absolute"
CHOSEN = "sub-01_ses-01_task-relative"
Kind = Callable[[Path], None]
STORED: dict[str, Kind] = {}
SHOWN: dict[str, Kind] = {}


def stored(kind: Kind) -> Kind:
    """A change to what sessions stored, from which every table can be made again."""
    STORED[kind.__name__.removeprefix("_")] = kind
    return kind


def of_tables(kind: Kind) -> Kind:
    """A change to what is made from what sessions stored."""
    SHOWN[kind.__name__.removeprefix("_")] = kind
    return kind


def source(root: Path, stem: str, name: str) -> Path:
    subject, session, _ = stem.split("_")
    return root / "sourcedata" / subject / session / f"{stem}_{name}"


def table(root: Path, stem: str, name: str) -> Path:
    subject, session, _ = stem.split("_")
    return root / subject / session / "beh" / f"{stem}_{name}"


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_bytes().splitlines()]


def write(path: Path, events: Iterable[dict[str, Any]]) -> None:
    path.write_bytes(b"".join(line_of(event) for event in events))


def edit(root: Path, stem: str, change: Callable[[list[dict[str, Any]]], Any]) -> None:
    """Change the events of a log in place; its lines keep the seals that they had."""
    path = source(root, stem, "log.jsonl")
    events = lines(path)
    changed = change(events)
    write(path, events if changed is None else changed)


def main_answers(events: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    return [e for e in events if e["event"] == "answer" and e["row"]["phase"] == "main"]


def edit_json(path: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    values = json.loads(path.read_text())
    change(values)
    path.write_text(json.dumps(values, indent=2, ensure_ascii=False) + "\n")


def edit_text(path: Path, pattern: str, by: str) -> None:
    text = path.read_text()
    changed = re.sub(pattern, by, text, count=1, flags=re.MULTILINE)
    assert changed != text, (path, pattern)
    path.write_text(changed)


def hash_anew(root: Path, stem: str) -> None:
    """State in the sidecar of the answers the hashes that the tables have now."""

    def change(values: dict[str, Any]) -> None:
        for name in values["Files"]:
            values["Files"][name] = sha256(table(root, stem, "").parent / name)

    edit_json(table(root, stem, "beh.json"), change)


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


# The log


@stored
def log_ratings(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        for answer in main_answers(events):
            answer["row"]["magnitude_similarity"] = 95.0

    edit(root, FIRST, change)


@stored
def log_ratings_and_sliders(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        for answer in main_answers(events):
            answer["row"]["magnitude_similarity"] = 95.0
        for event in events:
            if event["event"] == "slider" and event["scale"] == "magnitude":
                event["value"] = 95.0

    edit(root, FIRST, change)


@stored
def log_response_times(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        for answer in main_answers(events):
            answer["row"]["response_time_s"] = round(answer["row"]["response_time_s"] / 2, 3)

    edit(root, FIRST, change)


@stored
def log_response_times_of_a_minute(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        for answer in main_answers(events):
            answer["row"]["response_time_s"] += 60.0

    edit(root, FIRST, change)


@stored
def log_choices_all_right(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        for answer in main_answers(events):
            answer["row"]["answer"], answer["row"]["correct"] = answer["row"]["texture"], 1

    edit(root, CHOSEN, change)


@stored
def log_choices_and_buttons(root: Path) -> None:
    """The button that was chosen, and what it stands for in the answer, both changed."""

    def change(events: list[dict[str, Any]]) -> None:
        for answer in main_answers(events):
            row = answer["row"]
            button = row["layout"].split("|").index(row["texture"])
            row["answer"], row["correct"] = row["texture"], 1
            for event in events:
                if event["event"] == "chosen" and event.get("trial") == answer["trial"]:
                    event["index"] = button

    edit(root, CHOSEN, change)


@stored
def log_trial_deleted(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
        number = main_answers(events)[1]["trial"]
        return [event for event in events if event.get("trial") != number]

    edit(root, FIRST, change)


@stored
def log_answer_added(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
        answer = main_answers(events)[0]
        return [*events[:-2], answer, *events[-2:]]

    edit(root, FIRST, change)


@stored
def log_answer_invalid(root: Path) -> None:
    edit(root, FIRST, lambda events: main_answers(events)[0]["row"].update(valid=0))


@stored
def log_answer_invalid_by_a_fault(root: Path) -> None:
    """A fault of the rig that never was, so that an unwelcome answer does not count."""

    def change(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
        answer = main_answers(events)[0]
        answer["row"]["valid"] = 0
        at = events.index(answer)
        fault = {**{n: answer[n] for n in ("n", "utc", "t_s", "run")}, "event": "fault"}
        fault |= {"trial": answer["trial"], "code": "late", "invalidates": True, "told": "late"}
        fault["seal"] = answer["seal"]
        return [*events[:at], fault, *events[at:]]

    edit(root, FIRST, change)


@stored
def log_cut_off(root: Path) -> None:
    """Its second half deleted, as if the session had been killed."""
    edit(root, FIRST, lambda events: events[: len(events) // 2])


@stored
def log_times(root: Path) -> None:
    """A pause of a minute before one answer taken out."""

    def change(events: list[dict[str, Any]]) -> None:
        for event in events[len(events) // 2 :]:
            event["t_s"] = round(event["t_s"] + 60.0, 6)

    edit(root, FIRST, change)


@stored
def log_another_day(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        for event in events:
            event["utc"] = "2026-03-01" + event["utc"][10:]

    edit(root, FIRST, change)


@stored
def log_age(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        for event in events:
            if event["event"] == "welcome":
                event["answers"]["age"] += 1

    edit(root, FIRST, change)


@stored
def log_of_another_person(root: Path) -> None:
    shutil.copy(source(root, SECOND, "log.jsonl"), source(root, FIRST, "log.jsonl"))


@stored
def log_deleted(root: Path) -> None:
    source(root, FIRST, "log.jsonl").unlink()


# The manifest


@stored
def manifest_order(root: Path) -> None:
    """Two trials exchanged."""

    def change(values: dict[str, Any]) -> None:
        one, other = values["trials"][-2:]
        number, texture = one["trial"], other["trial"]
        values["trials"][-2:] = [{**other, "trial": number}, {**one, "trial": texture}]

    edit_json(source(root, FIRST, "manifest.json"), change)


@stored
def manifest_slot(root: Path) -> None:
    edit_json(source(root, FIRST, "manifest.json"), lambda values: values.update(slot=2))


@stored
def manifest_not_simulated(root: Path) -> None:
    """The twin's answers given out as those of a rig."""
    edit_json(
        source(root, FIRST, "manifest.json"), lambda values: values.update(simulated_rig=False)
    )


@stored
def manifest_pilot(root: Path) -> None:
    edit_json(source(root, FIRST, "manifest.json"), lambda values: values.update(pilot=True))


@stored
def manifest_version(root: Path) -> None:
    edit_json(
        source(root, FIRST, "manifest.json"),
        lambda values: values["versions"].update(tactileq="0.0.1"),
    )


@stored
def manifest_models(root: Path) -> None:
    def change(values: dict[str, Any]) -> None:
        for hashes in values["models_sha256"].values():
            hashes["simplified"] = "0" * 64

    edit_json(source(root, FIRST, "manifest.json"), change)


@stored
def manifest_study(root: Path) -> None:
    """Wider bounds of the claim."""

    def change(values: dict[str, Any]) -> None:
        values["study"]["name"] = "Another"

    edit_json(source(root, FIRST, "manifest.json"), change)


@stored
def manifest_deleted(root: Path) -> None:
    source(root, FIRST, "manifest.json").unlink()


# Sessions and people


def _delete_session(root: Path, stem: str) -> None:
    for folder in (source(root, stem, "").parent, table(root, stem, "").parent):
        for path in folder.glob(f"{stem}_*"):
            path.unlink()


def _copy_session(root: Path, stem: str, to: str) -> None:
    """What a session stored under another's name, all that names it changed along."""
    for path in sorted(source(root, stem, "").parent.glob(f"{stem}_*")):
        new = source(root, to, path.name.removeprefix(f"{stem}_"))
        new.parent.mkdir(parents=True, exist_ok=True)
        new.write_bytes(path.read_bytes())


@stored
def session_deleted(root: Path) -> None:
    _delete_session(root, FIRST)


@stored
def session_deleted_that_was_last(root: Path) -> None:
    _delete_session(root, "sub-02_ses-01_task-relative")


@stored
def session_replaced_by_another_persons(root: Path) -> None:
    """Its own order and name, the other's answers; rows name the trials of the own order."""
    own, other = (lines(source(root, stem, "log.jsonl")) for stem in (FIRST, SECOND))
    given = {answer["trial"]: answer["row"] for answer in main_answers(other)}
    trials = json.loads(source(root, FIRST, "manifest.json").read_text())["trials"]
    planned = {trial["trial"]: trial for trial in trials}
    changed = []
    for event in other:
        if event["event"] in ("opened", "welcome"):
            event = next(e for e in own if e["event"] == event["event"])
        elif event["event"] == "answer":
            names = ("phase", "texture", "model", "tray", "virtual_texture", "first_surface")
            trial = planned[event["row"]["repeats"] or event["trial"]]  # training that was repeated
            event["row"] |= {name: trial[name] for name in names if name in trial}
        changed.append(event)
    assert given
    write(source(root, FIRST, "log.jsonl"), changed)
    for name in ("hand.tsv", "presentations.tsv"):
        shutil.copy(source(root, SECOND, name), source(root, FIRST, name))


@stored
def session_copied_as_a_third_persons(root: Path) -> None:
    """A person who never came, with the answers of one who did."""
    to = FIRST.replace("sub-01", "sub-03")
    _copy_session(root, FIRST, to)
    edit_json(
        source(root, to, "manifest.json"),
        lambda values: values.update(subject=3, code="NEMO-33"),
    )
    roster = root / "sourcedata" / "roster.jsonl"
    first = lines(roster)[0]
    write(roster, [*lines(roster), {**first, "subject": 3, "code": "NEMO-33"}])


@stored
def person_deleted(root: Path) -> None:
    for folder in (root / "sourcedata" / "sub-01", root / "sub-01"):
        shutil.rmtree(folder)


@stored
def person_deleted_from_the_roster_too(root: Path) -> None:
    person_deleted(root)
    roster = root / "sourcedata" / "roster.jsonl"
    kept = (e for e in lines(roster) if e.get("subject") != 1)
    write(roster, (e for e in kept if not str(e.get("session")).startswith("sub-01")))


@stored
def person_withdrawn_who_did_not(root: Path) -> None:
    """Deleted, and the roster made to say that consent was withdrawn."""
    person_deleted(root)
    roster = root / "sourcedata" / "roster.jsonl"
    events = lines(roster)
    events[0]["code"] = ""
    last = events[-1]
    withdrawn = {"utc": last["utc"], "event": "withdrawn", "subject": 1, "seal": last["seal"]}
    write(roster, [*events, withdrawn])


@stored
def people_exchanged(root: Path) -> None:
    """The answers of one under the name of the other."""
    for name in ("log.jsonl", "hand.tsv", "presentations.tsv"):
        one, other = source(root, FIRST, name), source(root, SECOND, name)
        first, second = one.read_bytes(), other.read_bytes()
        one.write_bytes(second)
        other.write_bytes(first)


# The roster


def _edit_roster(root: Path, change: Callable[[list[dict[str, Any]]], Any]) -> None:
    roster = root / "sourcedata" / "roster.jsonl"
    events = lines(roster)
    changed = change(events)
    write(roster, events if changed is None else changed)


@stored
def roster_slot(root: Path) -> None:
    _edit_roster(root, lambda events: events[0].update(slot=2))


@stored
def roster_line_deleted(root: Path) -> None:
    _edit_roster(root, lambda events: [e for e in events if e.get("subject") != 1])


@stored
def roster_seal_deleted(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
        first = next(e for e in events if e["event"] == "sealed")
        return [event for event in events if event is not first]

    _edit_roster(root, change)


@stored
def roster_dropout_added(root: Path) -> None:
    """Somebody whose answers are unwelcome dropped out, and is analyzed no more."""

    def change(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
        last = events[-1]
        gone = {"utc": last["utc"], "event": "dropped", "subject": 2, "seal": last["seal"]}
        return [*events, gone]

    _edit_roster(root, change)


@stored
def roster_lines_exchanged(root: Path) -> None:
    def change(events: list[dict[str, Any]]) -> None:
        events[0], events[1] = events[1], events[0]

    _edit_roster(root, change)


@stored
def roster_deleted(root: Path) -> None:
    (root / "sourcedata" / "roster.jsonl").unlink()


# What lies beside the log


@stored
def hand_edited(root: Path) -> None:
    edit_text(source(root, FIRST, "hand.tsv"), r"(\d)\t", r"9\t")


@stored
def hand_deleted(root: Path) -> None:
    source(root, FIRST, "hand.tsv").unlink()


@stored
def hand_of_another_person(root: Path) -> None:
    shutil.copy(source(root, SECOND, "hand.tsv"), source(root, FIRST, "hand.tsv"))


@stored
def presentations_edited(root: Path) -> None:
    edit_text(source(root, FIRST, "presentations.tsv"), r"^(\d+\t)(\w+)", r"\1real")


@stored
def pen_file_added(root: Path) -> None:
    source(root, FIRST, "trial-002_pen.tsv").write_text("time_s\tacceleration_g\n0.0\t0.1\n")


# Tables


@of_tables
def answers_number(root: Path) -> None:
    edit_text(table(root, FIRST, "beh.tsv"), r"\t\d+\.\d+\t", "\t99.99\t")


@of_tables
def answers_number_and_hash(root: Path) -> None:
    answers_number(root)
    hash_anew(root, FIRST)


@of_tables
def answers_row_deleted(root: Path) -> None:
    edit_text(table(root, FIRST, "beh.tsv"), r"^2\t.*\n", "")


@of_tables
def answers_deleted(root: Path) -> None:
    table(root, FIRST, "beh.tsv").unlink()


@of_tables
def answers_of_another_person(root: Path) -> None:
    shutil.copy(table(root, SECOND, "beh.tsv"), table(root, FIRST, "beh.tsv"))


@of_tables
def answers_of_a_session_that_never_was(root: Path) -> None:
    for path in sorted(table(root, FIRST, "").parent.glob("*")):
        shutil.copy(path, path.with_name(path.name.replace("ses-01", "ses-02")))


@of_tables
def sidecar_edited(root: Path) -> None:
    edit_json(table(root, FIRST, "beh.json"), lambda values: values.update(Simulated=False))


@of_tables
def events_edited_and_hash(root: Path) -> None:
    edit_text(table(root, FIRST, "events.tsv"), r"^(\d)", "9")
    hash_anew(root, FIRST)


@of_tables
def events_deleted(root: Path) -> None:
    table(root, FIRST, "events.tsv").unlink()


@of_tables
def participants_age(root: Path) -> None:
    edit_text(root / "participants.tsv", r"^(sub-01.*)\t(\d+)(\t|$)", r"\1\t17\3")


@of_tables
def participants_row_deleted(root: Path) -> None:
    edit_text(root / "participants.tsv", r"^sub-01.*\n", "")


@of_tables
def description_study(root: Path) -> None:
    edit_json(
        root / "dataset_description.json",
        lambda values: values["StudyDesign"].update(seed=12),
    )


@of_tables
def description_models(root: Path) -> None:
    def change(values: dict[str, Any]) -> None:
        for hashes in values["ModelsSHA256"].values():
            hashes["simplified"] = "0" * 64

    edit_json(root / "dataset_description.json", change)


@of_tables
def description_not_simulated(root: Path) -> None:
    edit_json(
        root / "dataset_description.json",
        lambda values: values.update(Simulated=False, SimulatedRig=False),
    )


@of_tables
def description_deleted(root: Path) -> None:
    (root / "dataset_description.json").unlink()


@of_tables
def readme_edited(root: Path) -> None:
    edit_text(root / "README", r"\Z", "All participants were real.\n")


# Making the chain anew


def reseal(root: Path) -> None:
    """Seal each log and the roster as they are now, and make every table again.

    Each session then agrees with itself: lines are numbered again, and its log names the hashes
    that manifest and files beside it have.
    """
    for path in sorted(root.glob("sourcedata/sub-*/ses-*/*_log.jsonl")):
        _reseal_log(path)
    _reseal_roster(root, {})
    export_all(root)


def reseal_whole(root: Path) -> None:
    """As `reseal`, and the seals that the roster and later manifests name are made anew too."""
    roster = root / "sourcedata" / "roster.jsonl"
    events = lines(roster) if roster.exists() else []
    order = [event["session"] for event in events if event["event"] == "sealed"]
    stems = {p.name.removesuffix("_log.jsonl"): p for p in root.glob("sourcedata/sub-*/*/*_log.*")}
    order = [s for s in order if s in stems] + sorted(set(stems) - set(order))
    after: dict[str, str] = {}
    seals = {}
    for stem in order:
        manifest = source(root, stem, "manifest.json")
        if manifest.exists():
            edit_json(manifest, lambda values, named=after: values.update(after=named))
        seals[stem] = _reseal_log(stems[stem])
        after = {"session": stem, "seal": seals[stem]}
    if roster.exists():
        _reseal_roster(root, seals)
    export_all(root)


def _reseal_log(path: Path) -> str:
    stem = path.name.removesuffix("_log.jsonl")
    others = sorted(p for p in path.parent.glob(f"{stem}_*") if p != path)
    beside = {p.name: sha256(p) for p in others}
    events = lines(path)
    for event in events:
        if event["event"] == "opened":
            event["manifest_sha256"] = beside.get(f"{stem}_manifest.json", "")
        if event["event"] == "stored":
            event["files"] = beside
    text, seal = sealed(events)
    path.write_bytes(text)
    return seal


def _reseal_roster(root: Path, seals: dict[str, str]) -> None:
    path = root / "sourcedata" / "roster.jsonl"
    if not path.exists():
        return
    before = ""
    made = []
    for event in lines(path):
        event.pop("seal", None)
        if event["event"] == "sealed":
            if seals and event["session"] not in seals:
                continue
            event["log_seal"] = seals.get(event["session"], event["log_seal"])
        kept = {**event, "code": ""} if "code" in event else event
        before = hashlib.sha256(before.encode() + line_of(kept)).hexdigest()[:16]
        made.append(line_of({**event, "seal": before}))
    path.write_bytes(b"".join(made))
