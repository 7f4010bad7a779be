"""Who takes part: numbers, pseudonyms and slots of the design, in the order of enrolment.

docs/method/protocols.md#roster
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.sessions.files import open_file, write_all
from experiments.sessions.log import line_of, read_lines, utc_text
from experiments.sessions.writer import StoreError, store_error
from modeling import InputError
from modeling.checks import check_whole
from modeling.errors import shown
from modeling.files.places import locked
from modeling.files.syncing import make_folder, sync_folder
from modeling.files.writing import write_bytes

# Easy to say and to hear apart in English and in Japanese: TAKI-46.
_SYLLABLES = tuple(consonant + vowel for consonant in "KMNRST" for vowel in "AEIO")
_ADVICE = "make room or choose another data folder"


@dataclass(frozen=True, kw_only=True)
class Person:
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
    """

    subject: int
    slot: int
    code: str
    known: bool


class Roster:
    """The list of a data set's participants.

    Parameters
    ----------
    data_folder : path
        Root of the data set.
    """

    def __init__(self, data_folder: str | Path) -> None:
        self.path = Path(data_folder) / "sourcedata" / "roster.jsonl"

    @contextmanager
    def enrolling(
        self,
        subject: int | None,
        participants: int,
        *,
        simulated: bool = False,
        pilot: bool = False,
    ) -> Iterator[Person]:
        """The participant with this number, enrolled now if never before.

        Who is new is not enrolled after all where the block raises; meanwhile nobody else can be.

        Parameters
        ----------
        subject : int, optional
            ≥ 1; without it the lowest number that nobody has had.
        participants : int
            How many slots the task's design has.
        simulated, pilot : bool

        Yields
        ------
        Person
            With the slot of its own number if that is free, else with the lowest one that somebody
            left who withdrew or dropped out.

        Raises
        ------
        InputError
            If that participant left, is of another kind, or no slot is free.
        StoreError
            If the disk does not take it.
        """
        check_whole("subject", 1 if subject is None else subject, low=1, high=9999)
        with self._locked() as entries:
            number = subject if subject is not None else _first_free(entries)
            if number in entries:
                yield self._known(entries[number], participants, simulated=simulated)
                return
            slot = _slot(number, participants, entries)
            code = f"SIM-{number:03d}" if simulated else _new_code(entries)
            kind = {"simulated": simulated, "pilot": pilot}
            before = self.path.stat().st_size if self.path.exists() else 0
            self._append("enrolled", subject=number, slot=slot, code=code, **kind)
            try:
                yield Person(subject=number, slot=slot, code=code, known=False)
            except BaseException:
                os.truncate(self.path, before)
                raise

    def drop(self, subject: int) -> None:
        """Note that a participant will not come again, so that another one gets the slot.

        Raises
        ------
        InputError
            If nobody of that number takes part.
        StoreError
            If the disk does not take it.
        """
        with self._locked() as entries:
            self._taking_part(subject, entries)
            self._append("dropped", subject=subject)

    def withdraw(self, subject: int) -> None:
        """Note that a participant's data are deleted; the pseudonym goes, number and slot stay.

        Raises
        ------
        InputError
            If nobody of that number was enrolled, or the data are deleted already.
        StoreError
            If the disk does not take it.
        """
        with self._locked() as entries:
            if subject not in entries or entries[subject]["left"] == "withdrawn":
                raise _not_there(subject, self.path)
            lines = [
                line_of({**event, "code": ""} if _is_enrolment(event, subject) else event)
                for event in read_lines(self.path, "the roster").events
            ]
            lines.append(line_of({"utc": utc_text(), "event": "withdrawn", "subject": subject}))
            write_bytes(self.path, b"".join(lines))

    def subjects(self) -> dict[int, dict[str, Any]]:
        """Everybody who was ever enrolled, by number.

        Returns
        -------
        dict
            subject → {"subject", "slot", "code", "utc", "simulated", "pilot", "left"}, where `left`
            is "", "dropped" or "withdrawn".

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        if not os.path.lexists(self.path):
            return {}
        return _entries(read_lines(self.path, "the roster").events, self.path)

    @contextmanager
    def _locked(self) -> Iterator[dict[int, dict[str, Any]]]:
        """The entries, while no other process can change them."""
        try:
            make_folder(self.path.parent)
            with locked(self.path):
                self._cut_half_line()
                yield self.subjects()
        except StoreError:
            raise
        except OSError as error:
            raise store_error(error, self.path, _ADVICE) from error

    def _known(self, entry: Mapping[str, Any], participants: int, *, simulated: bool) -> Person:
        number, slot = entry["subject"], entry["slot"]
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
        return Person(subject=number, slot=slot, code=entry["code"], known=True)

    def _taking_part(self, subject: int, entries: Mapping[int, Mapping[str, Any]]) -> None:
        if subject not in entries or entries[subject]["left"]:
            raise _not_there(subject, self.path)

    def _cut_half_line(self) -> None:
        """Take away what a process left that was killed before it had enrolled anybody."""
        there = self.path.read_bytes() if self.path.exists() else b""
        whole = there.rfind(b"\n") + 1
        if whole < len(there):
            os.truncate(self.path, whole)

    def _append(self, event: str, **fields: object) -> None:
        handle = open_file(self.path, new=False)
        try:
            size = os.fstat(handle).st_size
            try:
                write_all(handle, line_of({"utc": utc_text(), "event": event, **fields}))
                os.fsync(handle)
            except OSError:
                os.ftruncate(handle, size)
                raise
        finally:
            os.close(handle)
        sync_folder(self.path.parent)


_LEFT = {"dropped": "dropped out", "withdrawn": "withdrew"}


def _is_enrolment(event: Mapping[str, Any], subject: int) -> bool:
    return bool(event["event"] == "enrolled" and event["subject"] == subject)


def _entries(events: tuple[dict[str, Any], ...], path: Path) -> dict[int, dict[str, Any]]:
    entries: dict[int, dict[str, Any]] = {}
    for line, event in enumerate(events, start=1):
        try:
            _enter(event, entries)
        except (KeyError, TypeError):
            raise InputError(
                f"expected somebody who enrolled or left in line {line} of {path}, got "
                f"{shown(event)}; restore the file from a copy."
            ) from None
    return entries


def _enter(event: Mapping[str, Any], entries: dict[int, dict[str, Any]]) -> None:
    subject, what = event["subject"], event["event"]
    if what == "enrolled":
        names = ("subject", "slot", "code", "utc", "simulated", "pilot")
        entry = {name: event[name] for name in names}
        if type(subject) is not int or type(entry["slot"]) is not int or subject in entries:
            raise TypeError
        entries[subject] = {**entry, "left": ""}
    else:
        entries[subject]["left"] = {"dropped": "dropped", "withdrawn": "withdrawn"}[what]


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


def _not_there(subject: int, path: Path) -> InputError:
    return InputError(
        f"expected a subject who takes part, got {shown(subject)}, who is not on {path} or has "
        "left; give the number of one who does."
    )
