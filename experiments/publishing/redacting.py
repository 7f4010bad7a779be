"""A copy of a data set that identifies no participant: without times of day, free text, pseudonyms.

docs/method/publishing.md#redacted
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.bids.export import export_all
from tactileq.experiments.sessions.bids.people import REDACTED
from tactileq.experiments.sessions.kept.data_set import DESCRIPTION_NAME
from tactileq.experiments.sessions.kept.log import Event, object_of, sealed_line, utc_text
from tactileq.experiments.sessions.kept.roster import Roster, sealed_roster_line
from tactileq.experiments.sessions.kept.stored_sessions import StoredSession, held_sessions
from tactileq.experiments.sessions.kept.texts import texts_of_sessions
from tactileq.modeling import InputError
from tactileq.modeling.files.documents import dump_json, read_json_object
from tactileq.modeling.files.hashes import sha256_of_paths
from tactileq.modeling.files.reading import read_bytes
from tactileq.modeling.files.wav import samples_only
from tactileq.modeling.files.writing import write_bytes

# When everybody's first session begins; others of the day follow after ten minutes each. At noon,
# so that a reader's time zone does not make another day of it.
BEGINNING = datetime(2000, 1, 1, 12, tzinfo=UTC)
_NEXT = timedelta(minutes=10)
LEFT_OUT = "not published"
# By event, the field that holds what people typed, or what a machine said about itself.
_TEXT = {"ended": "reason", "fault": "told"}
# Who writes the reason of an end; what the program writes tells nothing about a person.
_BY_PROGRAM = ("program", "signal")


@dataclass(frozen=True, kw_only=True)
class Redacted:
    """What a copy was made from.

    Parameters
    ----------
    seals : mapping of session to str
        Of the original logs' last lines; empty for those that an earlier version wrote.
    secrets : tuple of str
        What must not stand anywhere in what is published: pseudonyms.
    days : frozenset of str
        The dates in the copy, such as 2000-01-01.
    files : frozenset of Path
        All that was written.
    """

    seals: Mapping[str, str]
    secrets: tuple[str, ...]
    days: frozenset[str]
    files: frozenset[Path]


def redact(
    data_folder: Path,
    out: Path,
    *,
    sources: Mapping[str, str],
    described: Mapping[str, Any],
    free_text: bool = False,
) -> Redacted:
    """Copy a data set without what identifies participants, sealed anew, with all its tables.

    Parameters
    ----------
    data_folder : path
        Of which nothing differs from what its sessions stored (`verify_data`).
    out : path
        A folder that does not exist.
    sources : mapping of set of models to str
        Where the models are in what is published, for the manifests.
    described : mapping
        What the description of the data set states in addition, such as authors.
    free_text : bool
        Whether to keep what people typed: reasons of overrides and of ends, and faults as told.

    Raises
    ------
    InputError
        For a session that is damaged or running.
    """
    held, damaged = held_sessions(data_folder)
    if damaged:
        raise InputError(damaged[0].sentence)
    if running := [one.files.stem for one in held if one.running]:
        raise InputError(
            f"expected sessions that have ended, got {running[0]}, which is running; publish when "
            "it has ended."
        )
    *lines, _ = read_bytes(Roster(data_folder).path, "the roster").split(b"\n")
    roster = [object_of(line) for line in lines]
    begins = dict(_beginnings(held))
    copies = _Copies(change=_Change(sources=sources, free_text=free_text))
    for one in _in_order(held):
        files = one.manifest.files(out)
        files.folder.mkdir(parents=True, exist_ok=True)
        copies.add(one, files.folder, begins=begins[one.files.stem])
    for path in texts_of_sessions(held):
        copies.write(out / path, read_bytes(data_folder / path, "what participants read"))
    copies.write(Roster(out).path, _roster(roster, copies.seals))
    description = read_json_object(data_folder / DESCRIPTION_NAME, advice="restore the file")
    text = dump_json({**description, **described, REDACTED: True})
    copies.write(out / DESCRIPTION_NAME, text.encode())
    shown = export_all(out)
    return Redacted(
        seals={one.files.stem: str(_last(one).get("seal", "")) for one in held},
        secrets=tuple(e["code"] for e in roster if e["event"] == "enrolled" and e["code"]),
        days=frozenset(copies.days),
        files=frozenset({*copies.files, *shown.new}),
    )


def _last(one: StoredSession) -> Event:
    return one.state.events[-1] if one.state.events else {}


def _in_order(held: Sequence[StoredSession]) -> Iterator[StoredSession]:
    """Each session after the one whose seal its manifest names; no clock is trusted in this."""
    left = {one.files.stem: one for one in held}
    while left:
        named = {stem: (one.manifest.after or {}).get("session") for stem, one in left.items()}
        free = [stem for stem, session in named.items() if session == stem or session not in left]
        for stem in free or list(left):  # in a circle none comes first; then no seal is found
            yield left.pop(stem)


def _beginnings(held: Sequence[StoredSession]) -> Iterator[tuple[str, datetime]]:
    """When each session begins in the copy: days stay apart as they were, times of day do not.

    Whose clock fell back begins so many days later that nothing happens before `BEGINNING`'s day:
    logs of earlier years are none.
    """
    by_person: dict[str, list[StoredSession]] = {}
    for one in held:
        if one.state.events:
            by_person.setdefault(one.files.participant, []).append(one)
        else:
            yield one.files.stem, BEGINNING
    for sessions in by_person.values():
        in_order = sorted(sessions, key=lambda one: one.state.begun_utc)
        first = datetime.fromisoformat(in_order[0].state.begun_utc).date()
        on_day: Counter[timedelta] = Counter()
        begins = {}
        for one in in_order:
            days = datetime.fromisoformat(one.state.begun_utc).date() - first
            begins[one.files.stem] = BEGINNING + days + on_day[days] * _NEXT
            on_day[days] += 1
        moments = (m for one in in_order for m in _moments(one, begins[one.files.stem]))
        late = max(BEGINNING.date() - min(moments).date(), timedelta())
        yield from ((stem, moment + late) for stem, moment in begins.items())


def _moments(one: StoredSession, begins: datetime) -> list[datetime]:
    """When each event of a session happened, in a copy that begins then."""
    first = datetime.fromisoformat(one.state.begun_utc)
    return [begins + (datetime.fromisoformat(e["utc"]) - first) for e in one.state.events]


@dataclass(frozen=True, kw_only=True)
class _Change:
    """What becomes of manifests and events."""

    sources: Mapping[str, str]
    free_text: bool

    def manifest(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values of a manifest, or those of them that changed."""
        changed = dict(values)
        if "subject" in changed:
            changed["code"] = published_code(changed["subject"])
        if "platform" in changed:
            changed["platform"] = changed["platform"].partition("-")[0]
        if "model_sources" in changed:
            changed["model_sources"] = dict(self.sources)
        if "overrides" in changed:
            changed["overrides"] = self._overrides(changed["overrides"])
        return changed

    def event(self, event: Event) -> dict[str, Any]:
        """An event of a log, but for its time, its hashes and its seal."""
        changed = dict(event)
        name = _TEXT.get(event["event"], "")
        if isinstance(changed.get(name), str) and event.get("by") not in _BY_PROGRAM:
            changed[name] = self._text(changed[name])
        if "overrides" in changed:
            changed["overrides"] = self._overrides(changed["overrides"])
        if "changed" in changed:
            changed["changed"] = self.manifest(changed["changed"])
        if "cut" in changed:
            changed["cut"] = self._text(changed["cut"])
        return changed

    def _overrides(self, overrides: Sequence[Mapping[str, str]]) -> list[dict[str, str]]:
        return [{**one, "reason": self._text(one["reason"])} for one in overrides]

    def _text(self, text: str) -> str:
        return text if self.free_text or not text else LEFT_OUT


def published_code(subject: int) -> str:
    """What stands for a pseudonym, which only the participant and the laboratory know."""
    return f"P-{subject:03d}"


@dataclass(frozen=True, kw_only=True)
class _Copies:
    """Copies of sessions, sealed anew, and what was noted of them.

    Parameters
    ----------
    seals : dict of (session, str) to str
        A session and a seal in its log, with the seal of the same line in the copy.
    """

    change: _Change
    seals: dict[tuple[str, str], str] = field(default_factory=dict)
    days: set[str] = field(default_factory=lambda: {BEGINNING.date().isoformat()})
    files: set[Path] = field(default_factory=set)

    def write(self, path: Path, data: bytes) -> None:
        """Write a file, and note it."""
        write_bytes(path, data)
        self.files.add(path)

    def add(self, one: StoredSession, folder: Path, *, begins: datetime) -> None:
        """Manifest, log and what the session wrote beside them, into a folder."""
        manifest = folder / one.files.manifest.name
        values = self.change.manifest(
            read_json_object(one.files.manifest, advice="restore the file")
        )
        if after := values.get("after"):
            named = (after["session"], after["seal"])
            # or of who withdrew
            values["after"] = {**after, "seal": self.seals.get(named, after["seal"])}
        self.write(manifest, dump_json(values).encode())
        beside = {path: folder / path.name for path in one.files.beside()}
        for path, copy in beside.items():
            self.write(copy, _content(path))
        if one.state.events:
            found = sha256_of_paths(sorted([manifest, *beside.values()]))
            hashes = {Path(path).name: sha256 for path, sha256 in found.items()}
            own = {"manifest_sha256": hashes[manifest.name], "files": hashes}
            self.write(folder / one.files.log.name, b"".join(self._lines(one, own, begins=begins)))

    def _lines(
        self, one: StoredSession, own: Mapping[str, Any], *, begins: datetime
    ) -> Iterator[bytes]:
        """Those of the log; `own` are the hashes that it names."""
        named = {"opened": "manifest_sha256", "stored": "files"}
        seal = ""
        for event, moment in zip(one.state.events, _moments(one, begins), strict=True):
            self.days.add(moment.date().isoformat())
            changed = {**self.change.event(event), "utc": utc_text(moment)}
            if name := named.get(changed["event"]):
                changed[name] = own[name]
            was = changed.pop("seal", "")
            line, seal = sealed_line(changed, seal)
            self.seals[one.files.stem, was] = seal
            yield line


def _content(path: Path) -> bytes:
    """The bytes of a file that a session wrote; of a WAV file the samples alone.

    Raises
    ------
    InputError
        For a link, since what it leads to may be anybody's.
    """
    if path.is_symlink():
        raise InputError(
            f"expected a file that the session wrote at {path}, got a link to {path.readlink()}; "
            "put the file itself there."
        )
    data = read_bytes(path, "a file of a session")
    return samples_only(data, path) if path.suffix == ".wav" else data


def _roster(roster: Sequence[Event], seals: Mapping[tuple[str, str], str]) -> bytes:
    seal, lines = "", []
    for event in roster:
        changed: dict[str, Any] = {**event, "utc": utc_text(BEGINNING)}
        changed.pop("seal", None)
        if changed.get("code"):
            changed["code"] = published_code(changed["subject"])
        if changed["event"] == "sealed":
            named = (changed["session"], changed["log_seal"])
            changed["log_seal"] = seals.get(named, changed["log_seal"])  # or of who withdrew
        line, seal = sealed_roster_line(changed, seal)
        lines.append(line)
    return b"".join(lines)
