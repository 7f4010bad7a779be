"""What a session leaves on disk: order, responses, log and descriptions, in a BIDS-like folder.

Every answered trial is on disk before the next one begins, whatever happens to the process.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from experiments.sessions.traces import (
    HAND_COLUMNS,
    PRESENTATION_COLUMNS,
    hand_table,
    pen_file,
    presentation_table,
)
from experiments.study.design import SessionPlan
from experiments.study.study import Study
from modeling import InputError
from modeling.errors import shown
from modeling.files.documents import read_json_object
from modeling.files.hashes import sha256_of
from modeling.files.reading import read_text, reason_of
from modeling.files.writing import write_bytes
from rig.interface import Acceleration, Fault, HandRows, PresentationRecord

BIDS_VERSION = "1.10.0"
ORDER_FORMAT = "tactileq.session-order"
ORDER_VERSION = 1
MISSING = "n/a"
LOG_COLUMNS = ("time_utc", "event", "detail")
PARTICIPANT_COLUMNS = ("participant_id", "simulated")


class StoreError(OSError):
    """The disk did not take a file or a row; the message is one sentence for the user."""


class SessionStore:
    """The files of one session; made by `SessionStore.create`, used in a `with` block."""

    def __init__(self, responses: _Rows, log: _Rows, *, hand: _Rows, shown: _Rows) -> None:
        self._responses = responses
        self._log = log
        self._hand = hand
        self._shown = shown

    @property
    def path(self) -> Path:
        """The file that holds the responses."""
        return self._responses.path

    @classmethod
    def create(
        cls,
        data_folder: str | Path,
        *,
        plan: SessionPlan,
        columns: Mapping[str, Mapping[str, Any]],
        description: str,
        models: Mapping[str, Mapping[str, str]],
        simulated_participant: bool,
        simulated_rig: bool,
        rig: Mapping[str, object] | None = None,
    ) -> SessionStore:
        """Make the files of a session that has none yet, the order of its trials first.

        Parameters
        ----------
        data_folder : path
            Root of the data set; made if it is not there.
        plan : SessionPlan
            Written and forced to disk before anything is presented.
        columns : mapping of str to mapping
            The columns of the responses in order, each with its BIDS description.
        description : str
            What the participant does, for the sidecar.
        models : mapping of texture to mapping of kind to SHA-256
            The models that are presented; one data set holds answers about one set of them.
        simulated_participant, simulated_rig : bool
            Whether they are simulated; one data set holds one kind.
        rig : mapping, optional
            What the sidecar says of the rig: its file's SHA-256, what is assumed.

        Raises
        ------
        InputError
            If the session exists, is being run, or the folder belongs to another study.
        StoreError
            If the disk does not take the files.
        """
        root = Path(data_folder)
        made: list[Path] = []
        simulated = {
            "Simulated": simulated_participant or simulated_rig,
            "SimulatedParticipant": simulated_participant,
            "SimulatedRig": simulated_rig,
        }
        try:
            root.mkdir(parents=True, exist_ok=True)
            origin = {
                **simulated,
                "StudySHA256": plan.study.sha256,
                "ModelsSHA256": {texture: dict(kinds) for texture, kinds in models.items()},
            }
            _describe_data_set(root, plan.study, origin=origin)
            order = _order_text(plan)
            fixed = origin | {"OrderSHA256": sha256_of(order)}
            stated = fixed | ({"Rig": dict(rig)} if rig else {})
            sidecar = _sidecar_text(plan, columns, description=description, origin=stated)
            store = cls._make_files(
                root, plan, columns=tuple(columns), order=order, sidecar=sidecar, made=made
            )
            _add_participant(root, plan.subject, simulated=simulated_participant)
            _sync_folder(root)
        except OSError as error:
            _remove(made)
            raise _store_error(error, root, "Nothing was presented") from error
        except InputError:
            _remove(made)
            raise
        return store

    @classmethod
    def _make_files(
        cls,
        root: Path,
        plan: SessionPlan,
        *,
        columns: tuple[str, ...],
        order: str,
        sidecar: str,
        made: list[Path],
    ) -> SessionStore:
        stem = session_stem(plan)
        session = Path(*stem.split("_")[:2])
        beh, source = root / session / "beh", root / "sourcedata" / session
        for folder in (beh, source):
            folder.mkdir(parents=True, exist_ok=True)
        try:
            # The order file is the session's lock: only one process can make it.
            _write_new(source / f"{stem}_order.json", order, made=made)
            _write_new(beh / f"{stem}_beh.json", sidecar, made=made)
            log = _Rows.create(source / f"{stem}_log.tsv", LOG_COLUMNS, made=made)
            traces = []
            for name, described in (
                ("hand", HAND_COLUMNS),
                ("presentations", PRESENTATION_COLUMNS),
            ):
                _write_new(source / f"{stem}_{name}.json", _json(described), made=made)
                path = source / f"{stem}_{name}.tsv"
                traces.append(_Rows.create(path, tuple(described), made=made))
            rows = _Rows.create(beh / f"{stem}_beh.tsv", columns, made=made)
        except FileExistsError as error:
            raise InputError(
                f"expected a session that has not been run, got {stem}, which has the file "
                f"{error.filename}; choose another session or data folder, or move its files away."
            ) from None
        for folder in (source, beh):
            _sync_folder(folder)
        hand, shown = traces
        return cls(rows, log, hand=hand, shown=shown)

    def append(self, row: Mapping[str, object]) -> None:
        """Write one answered trial and force it to disk.

        Raises
        ------
        InputError
            If the row's columns are not those of the file.
        StoreError
            If the disk does not take it; the rows before it stay as they are.
        """
        self._responses.append(row)

    def trace(
        self,
        trial: int,
        rows: HandRows,
        *,
        presentations: Sequence[PresentationRecord],
        faults: Sequence[Fault],
    ) -> None:
        """Write what the hand did in a trial, and what was presented to it.

        Raises
        ------
        StoreError
            If the disk does not take it.
        """
        self._shown.extend(presentation_table(trial, presentations, rows=rows, faults=faults))
        self._hand.extend(hand_table(trial, rows))

    def acceleration(self, trial: int, pieces: Sequence[Acceleration]) -> None:
        """Write what was measured at the pen in a trial: a WAV file in g for each piece.

        Raises
        ------
        StoreError
            If the disk does not take it.
        """
        stem = self._hand.path.name.removesuffix("_hand.tsv")
        for number, piece in enumerate(pieces, start=1):
            path = self._hand.path.with_name(f"{stem}_trial-{trial:03d}_pen-{number}.wav")
            try:
                write_bytes(path, pen_file(piece))
            except OSError as error:
                raise _store_error(error, path, "The answers are safe") from error
            self.log(
                "pen recorded", f"{path.name}, first sample {piece.start_s:.6f} s after opening"
            )

    def log(self, event: str, detail: str = MISSING) -> None:
        """Write one event with its time, and force it to disk.

        Raises
        ------
        StoreError
            If the disk does not take it.
        """
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._log.append({"time_utc": now, "event": event, "detail": detail})

    def close(self) -> None:
        """Close the files; everything in them is on disk already."""
        for table in (self._responses, self._log, self._hand, self._shown):
            table.close()

    def __enter__(self) -> SessionStore:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def session_stem(plan: SessionPlan) -> str:
    """Beginning of the names of a session's files, as sub-01_ses-01_task-absolute."""
    return f"sub-{plan.subject:02d}_ses-{plan.session:02d}_task-{plan.task}"


def cell(value: object) -> str:
    r"""A value as one cell of a table: n/a for nothing, and no tab, line end or quote in it.

    Characters that would break a row are written as Python would (``\t``, ``\n``, ``\x22``).

    Raises
    ------
    InputError
        For an infinite number.
    """
    if value is None or value == "":
        return MISSING
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float | np.floating):
        if math.isinf(value):
            raise InputError(f"expected a finite number in a row, got {value}; present it again.")
        return MISSING if math.isnan(value) else f"{value:.10g}"
    text = str(value)
    if text.isprintable() and "\\" not in text and '"' not in text:
        return text  # as nearly all are
    return "".join(_plain(character) for character in text)


def _plain(character: str) -> str:
    if character == "\\":
        return "\\\\"
    if character == '"':
        # A reader that knows quotes would swallow tabs and lines after a leading one.
        return "\\x22"
    if character.isprintable():
        return character
    return character.encode("unicode_escape").decode("ascii")


class _Rows:
    """A table that only grows, by whole rows, each forced to disk."""

    def __init__(self, path: Path, columns: tuple[str, ...], handle: int) -> None:
        self.path = path
        self._columns = columns
        self._handle = handle

    @classmethod
    def create(cls, path: Path, columns: tuple[str, ...], *, made: list[Path]) -> _Rows:
        """A new table with its header; FileExistsError if there is one."""
        handle = _open_new(path)
        made.append(path)
        try:
            _write_all(handle, "\t".join(columns) + "\n")
        except OSError:
            os.close(handle)
            raise
        return cls(path, columns, handle)

    def append(self, row: Mapping[str, object]) -> None:
        self._write(self._line(row), sync=True)

    def extend(self, rows: Iterable[Mapping[str, object]]) -> None:
        """Several rows, which the system writes to the disk when it gets round to it."""
        self._write("".join(map(self._line, rows)), sync=False)

    def _line(self, row: Mapping[str, object]) -> str:
        if set(row) != set(self._columns):
            raise InputError(
                f"expected the columns {', '.join(self._columns)} in a row, got "
                f"{', '.join(row)}; give each of them once."
            )
        return "\t".join(cell(row[column]) for column in self._columns) + "\n"

    def _write(self, text: str, *, sync: bool) -> None:
        end = os.fstat(self._handle).st_size
        try:
            _write_all(self._handle, text, sync=sync)
        except OSError as error:
            # Half a row would spoil the table for every reader: cut it off again.
            with suppress(OSError):
                os.ftruncate(self._handle, end)
            raise _store_error(error, self.path, "The rows before it are safe") from error

    def close(self) -> None:
        os.close(self._handle)


def _open_new(path: Path) -> int:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
    return os.open(path, flags, 0o644)


def _write_all(handle: int, text: str, *, sync: bool = True) -> None:
    data = text.encode("utf-8")
    while data:
        data = data[os.write(handle, data) :]
    if sync:
        os.fsync(handle)


def _write_new(path: Path, text: str, *, made: list[Path]) -> None:
    handle = _open_new(path)
    made.append(path)
    try:
        _write_all(handle, text)
    except OSError:
        with suppress(OSError):
            path.unlink()  # half a file would be taken for another study's
        raise
    finally:
        os.close(handle)


def _remove(paths: list[Path]) -> None:
    for path in paths:
        with suppress(OSError):
            path.unlink()


def _sync_folder(folder: Path) -> None:
    """Force the names of new files to disk too (Windows does so by itself)."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _store_error(error: OSError, path: Path, comfort: str) -> StoreError:
    reason = reason_of(error)
    return StoreError(
        f"expected to write to {path}, got '{reason}' from the disk. {comfort}; "
        "make room or choose another data folder."
    )


def _json(values: Mapping[str, Any]) -> str:
    return json.dumps(values, indent=2, ensure_ascii=False) + "\n"


def _order_text(plan: SessionPlan) -> str:
    stated = {"format": ORDER_FORMAT, "version": ORDER_VERSION, "study_sha256": plan.study.sha256}
    return _json({**stated, **plan.to_dict()})


def _sidecar_text(
    plan: SessionPlan,
    columns: Mapping[str, Mapping[str, Any]],
    *,
    description: str,
    origin: Mapping[str, Any],
) -> str:
    study = plan.study
    return _json(
        {
            "TaskName": plan.task,
            "TaskDescription": description,
            "StudyName": study.name,
            "Masking": study.masking,
            "SurfaceVisible": study.surface_visible,
            "Schedule": study.plan_of(plan.task).schedule,
            **origin,
            **columns,
        }
    )


def _describe_data_set(root: Path, study: Study, *, origin: Mapping[str, Any]) -> None:
    """Write the description of the data set, or check that the one there is of this origin."""
    design = study.to_dict()
    wanted = {"Name": study.name, "StudyDesign": design, **origin}
    values = {
        "Name": study.name,
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "raw",
        "License": study.data_license,
        **origin,
        "StudyDesign": design,
        "GeneratedBy": [{"Name": "tactileq", "Version": _own_version()}],
    }
    path = root / "dataset_description.json"
    try:
        _write_new(path, _json(values), made=[])
        _write_new(root / "participants.json", _json(_PARTICIPANTS_SIDECAR), made=[])
    except FileExistsError:
        _check_description(path, json.loads(_json(wanted)))


def _check_description(path: Path, wanted: Mapping[str, Any]) -> None:
    found = read_json_object(path, advice="choose another data folder for these sessions")
    for key, value in wanted.items():
        there = found.get(key)
        if there == value:
            continue
        if isinstance(value, dict) and isinstance(there, dict):
            changed = sorted(k for k in value.keys() | there if value.get(k) != there.get(k))
            key, there, value = f"{key} unchanged", f"another {', '.join(changed)}", "as begun"
        raise InputError(
            f"expected a data folder with {key} {shown(value)} in {path}, got {shown(there)}; "
            "choose another data folder for these sessions."
        )


_PARTICIPANTS_SIDECAR = {
    "participant_id": {"Description": "Participant"},
    "simulated": {
        "Description": "Whether the participant was simulated",
        "Levels": {"true": "simulated", "false": "a person"},
    },
}


def _add_participant(root: Path, subject: int, *, simulated: bool) -> None:
    """Add the participant to the list, once; rows are only ever appended."""
    path = root / "participants.tsv"
    name = f"sub-{subject:02d}"
    with suppress(FileExistsError):
        _write_new(path, "\t".join(PARTICIPANT_COLUMNS) + "\n", made=[])
    lines = read_text(path, "the list of participants").splitlines()
    if name in (line.split("\t")[0] for line in lines):
        return
    handle = os.open(path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
    try:
        _write_all(handle, f"{name}\t{cell(simulated)}\n")
    finally:
        os.close(handle)


def _own_version() -> str:
    try:
        return version("tactileq")
    except PackageNotFoundError:
        return "not installed"
