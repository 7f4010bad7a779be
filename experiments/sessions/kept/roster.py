"""Who takes part: numbers, pseudonyms and slots of the design, in the order of enrolment.

docs/method/protocols.md#roster
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.kept.files import open_file, sessions_in, write_all
from tactileq.experiments.sessions.kept.log import (
    is_time,
    line_of,
    object_of,
    seal_after,
    utc_text,
)
from tactileq.experiments.sessions.kept.writer import StoreError, store_error
from tactileq.modeling import InputError
from tactileq.modeling.checks import check_whole
from tactileq.modeling.errors import shown
from tactileq.modeling.files.places import locked
from tactileq.modeling.files.reading import read_bytes
from tactileq.modeling.files.syncing import make_folder, sync_folder
from tactileq.modeling.files.writing import write_bytes

# Easy to say and to hear apart in English and in Japanese: TAKI-46.
_SYLLABLES = tuple(consonant + vowel for consonant in "KMNRST" for vowel in "AEIO")
_ADVICE = "free disk space or choose another data folder"


@dataclass(frozen=True, kw_only=True)
class Listed:
    """What can be read of a roster.

    Parameters
    ----------
    entries : mapping of subject to mapping
        As `Roster.subjects` gives them.
    damaged : str
        What cannot be read, in words; empty where all can be. Then nobody new is enrolled: whose
        number and slot stood there is not known.
    seals : tuple of LastSeal
        In the order in which sessions ended.
    broken : int
        Number of the first line whose own seal is not over it and all lines before; 0 if none is.
        Lines before the first one with a seal are an earlier version's.
    sealed : bool
        Whether its last line has a seal.
    declined : int
        How many people did not consent, and were not enrolled.
    latest_utc : str
        The latest time on it; empty where there is none.
    """

    entries: dict[int, dict[str, Any]]
    damaged: str = ""
    seals: tuple[LastSeal, ...] = ()
    broken: int = 0
    sealed: bool = False
    declined: int = 0
    latest_utc: str = ""


@dataclass(frozen=True)
class LastSeal:
    """A session that ended, as sub-01_ses-01_task-absolute, and the seal of its log's last line."""

    session: str
    seal: str


@dataclass(frozen=True, kw_only=True)
class RosterEntry:
    """Somebody who takes part.

    Parameters
    ----------
    subject : int
        From 1; never given to anybody else.
    slot : int
        The place in the design: whose share of the balanced parts of the order it is.
    code : str
        Pseudonym, such as TAKI-46.
    known : bool
        Whether this person was enrolled before.
    after : LastSeal, optional
        Of the session of the data set that ended last; None before the first.
    """

    subject: int
    slot: int
    code: str
    known: bool
    after: LastSeal | None = None


class Roster:
    """The list of a data set's participants.

    Parameters
    ----------
    data_folder : path
        Root of the data set.
    """

    def __init__(self, data_folder: str | Path) -> None:
        self._root = Path(data_folder)
        self.path = self._root / "sourcedata" / "roster.jsonl"

    @contextmanager
    def enrolling(
        self,
        subject: int | None,
        participants: int,
        *,
        simulated: bool = False,
        pilot: bool = False,
    ) -> Iterator[RosterEntry]:
        """The participant with this number, enrolled now if never before.

        Who is new is not enrolled after all where the block raises and leaves no session of theirs;
        meanwhile no one else can be.

        Parameters
        ----------
        subject : int, optional
            ≥ 1; without it the lowest number that has not been used.
        participants : int
            How many slots the task's design has.

        Yields
        ------
        RosterEntry
            With the slot of its own number if that is free, else with the lowest one that somebody
            left who withdrew or dropped out.

        Raises
        ------
        InputError
            If that participant left, is of another kind, or no slot is free; of somebody new also
            if anything in the roster cannot be read.
        StoreError
            If the disk does not take it.
        """
        check_whole("subject", 1 if subject is None else subject, low=1, high=9999)
        with self._locked() as listed:
            entries = listed.entries
            number = subject if subject is not None else _first_free(entries)
            if number in entries:
                _require_own_slot(number, entries, path=self.path)
                yield self._returning(listed, number, participants, simulated=simulated)
                return
            self._require_whole(listed)
            slot = _slot(number, participants, entries)
            code = f"SIM-{number:03d}" if simulated else _new_code(entries)
            kind = {"simulated": simulated, "pilot": pilot}
            before = self.path.stat().st_size if self.path.exists() else 0
            self._append("enrolled", subject=number, slot=slot, code=code, **kind)
            try:
                yield RosterEntry(
                    subject=number, slot=slot, code=code, known=False, after=_last(listed)
                )
            except BaseException:
                # A signal may have come once the session was there: then both stay.
                if all(files.subject != number for files in sessions_in(self._root)):
                    os.truncate(self.path, before)
                raise

    def slot_for(self, subject: int, participants: int, *, simulated: bool = False) -> int:
        """The slot with which `enrolling` would take this participant now; nothing is written.

        Raises
        ------
        InputError
            As `enrolling`.
        """
        check_whole("subject", subject, low=1, high=9999)
        listed = self.listed()
        if subject in listed.entries:
            _require_own_slot(subject, listed.entries, path=self.path)
            return self._returning(listed, subject, participants, simulated=simulated).slot
        self._require_whole(listed)
        return _slot(subject, participants, listed.entries)

    def note_seal(self, sealed: LastSeal) -> None:
        """Note the seal with which a session ended.

        Raises
        ------
        StoreError
            If the disk does not take it.
        """
        with self._locked():
            self._append("sealed", session=sealed.session, log_seal=sealed.seal)

    def decline(self) -> None:
        """Count somebody who did not consent; nothing else is kept, not even when it was.

        Raises
        ------
        StoreError
            If the disk does not take it.
        """
        with self._locked():
            self._append(_DECLINED)

    def drop(self, subject: int) -> None:
        """Note that a participant will not come again, so that another one gets the slot.

        Raises
        ------
        InputError
            If nobody with that number takes part.
        StoreError
            If the disk does not take it.
        """
        with self._locked() as listed:
            if subject not in listed.entries or listed.entries[subject]["left"]:
                raise self._not_there(subject, listed)
            self._append("dropped", subject=subject)

    def withdraw(self, subject: int) -> None:
        """Note that a participant's data are deleted; the pseudonym goes, number and slot stay.

        Raises
        ------
        InputError
            If nobody with that number was enrolled, or the data are deleted already, or the line
            that says so cannot be read.
        StoreError
            If the disk does not take it.
        """
        with self._locked() as listed:
            entry = listed.entries.get(subject, {"left": "withdrawn"})
            if entry["left"] == "withdrawn":
                raise self._not_there(subject, listed)
            # Damaged lines stay as they are: they may be all that there is of somebody else.
            lines = self.path.read_bytes().splitlines(keepends=True)
            withdrawn = {"utc": utc_text(), "event": "withdrawn", "subject": subject}
            lines.append(sealed_roster_line(withdrawn, _last_seal(lines))[0])
            lines = [_without_code(line, subject) for line in lines]
            write_bytes(self.path, b"".join(lines))

    def subjects(self) -> dict[int, dict[str, Any]]:
        """Everybody who was ever enrolled, by number, as far as the roster can be read.

        Returns
        -------
        dict
            subject → {"subject", "slot", "code", "utc", "simulated", "pilot", "left"}, where `left`
            is "", "dropped" or "withdrawn".

        Raises
        ------
        InputError
            If there is something that is no file.
        """
        return self.listed().entries

    def listed(self) -> Listed:
        """What can be read of it, line by line; raises as `subjects`."""
        entries: dict[int, dict[str, Any]] = {}
        seals: list[LastSeal] = []
        damaged, declined, latest_utc = [], 0, ""
        lines: list[bytes] = []
        if os.path.lexists(self.path):
            *lines, _ = read_bytes(self.path, "the roster").split(b"\n")
            for number, line in enumerate(lines, start=1):
                try:
                    event = object_of(line)
                    if event["event"] == _DECLINED:
                        declined += 1
                    else:
                        _enter(event, entries, seals)
                        latest_utc = max(latest_utc, _time_of(event))
                except (KeyError, TypeError, ValueError):
                    damaged.append(f"line {number} of {self.path}")
        # A list that was cut short between two lines misses somebody who was here.
        here = {files.subject: files.participant for files in sessions_in(self._root)}
        missing = [name for subject, name in here.items() if subject not in entries]
        damaged += [f"no line of {name} in {self.path}" for name in missing]
        return Listed(
            entries=entries,
            damaged=damaged[0] if damaged else "",
            seals=tuple(seals),
            broken=_first_broken(lines),
            sealed=bool(_last_seal(lines)),
            declined=declined,
            latest_utc=latest_utc,
        )

    @contextmanager
    def _locked(self) -> Iterator[Listed]:
        """What it holds, while no other process can change it."""
        try:
            make_folder(self.path.parent)
            with locked(self.path):
                self._cut_half_line()
                yield self.listed()
        except StoreError:
            raise
        except OSError as error:
            raise store_error(error, self.path, _ADVICE) from error

    def _returning(
        self, listed: Listed, number: int, participants: int, *, simulated: bool
    ) -> RosterEntry:
        entry = listed.entries[number]
        slot = entry["slot"]
        if entry["left"]:
            raise InputError(
                f"expected somebody who takes part, got subject {number}, who "
                f"{_LEFT[entry['left']]}; choose another number, which gets the slot."
            )
        if entry["simulated"] is not simulated:
            kinds = ("a person", "simulated")
            raise InputError(
                f"expected subject {number} to be {kinds[entry['simulated']]}, as enrolled in "
                f"{self.path}, got {kinds[simulated]}; choose another data folder."
            )
        if slot > participants:
            raise InputError(
                f"expected one of the {participants} slots of the task, got subject {number} with "
                f"slot {slot}; choose a subject with a lower slot, or plan more participants."
            )
        return RosterEntry(
            subject=number, slot=slot, code=entry["code"], known=True, after=_last(listed)
        )

    def _require_whole(self, listed: Listed) -> None:
        if listed.damaged:
            raise InputError(
                "expected a roster that can be read before somebody new gets a number and a slot, "
                f"got {listed.damaged}, which may belong to another person; restore "
                "the file from a copy."
            )

    def _not_there(self, subject: int, listed: Listed) -> InputError:
        damaged = f", which is damaged ({listed.damaged})" if listed.damaged else ""
        advice = "restore the file from a copy, or " if listed.damaged else ""
        return InputError(
            f"expected a subject who takes part, got {shown(subject)}, who is not on {self.path}"
            f"{damaged} or has left; {advice}give the number of one who does."
        )

    def _cut_half_line(self) -> None:
        """Remove what a process left that was killed before it had enrolled anybody."""
        there = self.path.read_bytes() if self.path.exists() else b""
        whole = there.rfind(b"\n") + 1
        if whole < len(there):
            os.truncate(self.path, whole)

    def _append(self, event: str, **fields: object) -> None:
        handle = open_file(self.path, new=False)
        try:
            size = os.fstat(handle).st_size
            time = {} if event == _DECLINED else {"utc": utc_text()}
            values = {**time, "event": event, **fields}
            before = _last_seal(self.path.read_bytes().splitlines())
            try:
                write_all(handle, sealed_roster_line(values, before)[0])
                os.fsync(handle)
            except OSError:
                os.ftruncate(handle, size)
                raise
        finally:
            os.close(handle)
        sync_folder(self.path.parent)


_DECLINED = "declined"
_LEFT = {"dropped": "dropped out", "withdrawn": "withdrew"}


def sealed_roster_line(values: Mapping[str, Any], before: str) -> tuple[bytes, str]:
    """Values as a line that ends with its seal, over what stays when somebody withdraws; the seal.

    `before` is the seal of the line before, empty for the first.
    """
    seal = _seal_after(before, values)
    return line_of({**values, "seal": seal}), seal


def _seal_after(before: str, values: Mapping[str, Any]) -> str:
    kept = {name: value for name, value in values.items() if name != "seal"}
    return seal_after(before, line_of(kept | {"code": ""} if "code" in kept else kept))


def _last_seal(lines: Sequence[bytes]) -> str:
    """That of the last line; empty where there is none, or it cannot be read."""
    try:
        return str(object_of(lines[-1]).get("seal", ""))
    except (IndexError, ValueError):
        return ""


def _first_broken(lines: Sequence[bytes]) -> int:
    """See Listed."""
    before = ""
    for number, line in enumerate(lines, start=1):
        try:
            values = object_of(line)
        except ValueError:
            return number
        if before or "seal" in values:
            before = _seal_after(before, values)
            if values.get("seal") != before:
                return number
    return 0


def _without_code(line: bytes, subject: int) -> bytes:
    """A line of the roster; the one that enrolled this subject without its pseudonym."""
    try:
        event = object_of(line)
    except ValueError:
        return line
    enrolment = event.get("event") == "enrolled" and event.get("subject") == subject
    return line_of({**event, "code": ""}) if enrolment else line


def _time_of(event: Mapping[str, Any]) -> str:
    """In UTC, as every line has it; empty where it is none, which nothing else hangs on."""
    return str(event["utc"]) if is_time(event.get("utc")) else ""


def _last(listed: Listed) -> LastSeal | None:
    return listed.seals[-1] if listed.seals else None


def _enter(
    event: Mapping[str, Any], entries: dict[int, dict[str, Any]], seals: list[LastSeal]
) -> None:
    """Note who enrolled or left, or what ended; KeyError, TypeError or ValueError for all else."""
    if event["event"] == "sealed":
        sealed = LastSeal(event["session"], event["log_seal"])
        if not (isinstance(sealed.session, str) and isinstance(sealed.seal, str)):
            raise TypeError(sealed)
        seals.append(sealed)
        return
    subject, what = event["subject"], event["event"]
    if what != "enrolled":
        entries[subject]["left"] = {"dropped": "dropped", "withdrawn": "withdrawn"}[what]
        return
    entry = {name: event[name] for name in _KINDS}
    fits = all(type(value) is _KINDS[name] for name, value in entry.items())
    if not fits or not 1 <= subject <= 9999 or entry["slot"] < 1 or subject in entries:
        raise ValueError(subject)
    entries[subject] = {**entry, "left": ""}


_KINDS = {"subject": int, "slot": int, "code": str, "utc": str, "simulated": bool, "pilot": bool}


def _require_own_slot(
    subject: int, entries: Mapping[int, Mapping[str, Any]], *, path: Path
) -> None:
    """Refuse whose slot somebody has who came later: the line that freed it was lost."""
    later = list(entries.values())[list(entries).index(subject) + 1 :]
    slot = entries[subject]["slot"]
    others = [one["subject"] for one in later if one["slot"] == slot and not one["left"]]
    if others and not entries[subject]["left"]:
        raise InputError(
            f"expected slot {slot} to be that of subject {subject} alone, got subject {others[0]} "
            f"enrolled in it later; note that subject {subject} dropped out, or restore {path}."
        )


def _first_free(entries: Mapping[int, object]) -> int:
    return next(n for n in range(1, len(entries) + 2) if n not in entries)


def _slot(subject: int, participants: int, entries: Mapping[int, Mapping[str, Any]]) -> int:
    held: set[int] = {entry["slot"] for entry in entries.values() if not entry["left"]}
    if 1 <= subject <= participants and subject not in held:
        return subject
    # Of somebody who left, or whose number took over another slot.
    freed = {slot for slot in entries if slot <= participants} - held
    if freed:
        return min(freed)
    raise InputError(
        f"expected a subject from 1 to {participants}, or one in the place of a dropout, got "
        f"subject {shown(subject)}; note who dropped out, or plan more participants."
    )


def _new_code(entries: Mapping[int, Mapping[str, Any]]) -> str:
    taken = {entry["code"] for entry in entries.values()}
    while True:
        first, second = secrets.choice(_SYLLABLES), secrets.choice(_SYLLABLES)
        code = f"{first}{second}-{10 + secrets.randbelow(90)}"
        if first != second and code not in taken:
            return code
