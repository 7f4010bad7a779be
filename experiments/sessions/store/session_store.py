"""What a session leaves on disk: its manifest, its log, and beside them what the hand did.

The log is the one truth; what BIDS shows is made from it. An answer counts once it is forced to
disk, whatever happens to the process afterwards (docs/method/protocols.md#storing).
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from tactileq.experiments.sessions.kept.data_set import differing
from tactileq.experiments.sessions.kept.files import (
    SessionFiles,
    open_file,
    write_new,
)
from tactileq.experiments.sessions.kept.log import (
    OWN_FIELDS,
    SESSION_ENDS,
    check_event,
    is_time,
    plain,
    read_log,
    utc_text,
)
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.overrides import Overrides
from tactileq.experiments.sessions.kept.state import SessionState, state_of
from tactileq.experiments.sessions.kept.stored_sessions import check_named, held_session, wrong_in
from tactileq.experiments.sessions.kept.tables import GrowingTable
from tactileq.experiments.sessions.kept.texts import TextsByLanguage, write_texts
from tactileq.experiments.sessions.kept.traces import (
    HAND_COLUMNS,
    PRESENTATION_COLUMNS,
    WALL_COLUMNS,
    hand_lines,
    pen_file,
    presentation_table,
)
from tactileq.experiments.sessions.kept.writer import LogWriter, StoreError, store_error
from tactileq.experiments.sessions.store.admission import admit, refuse_begun, require_admissible
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.columns import Column, sidecar
from tactileq.modeling.files.documents import dump_json
from tactileq.modeling.files.hashes import sha256_of_paths
from tactileq.modeling.files.locks import HeldError, Lock
from tactileq.modeling.files.places import locked
from tactileq.modeling.files.syncing import make_folder, sync_folder
from tactileq.modeling.files.writing import write_bytes
from tactileq.rig.shared.interface import Acceleration, Fault, HandRows, PresentationRecord

CLAIM_S = 0.2  # who only asks whether a session is running holds its lock for a moment
_NOTHING = "nothing was presented: free disk space or choose another data folder"


class SessionStore:
    """The files of one session, which no other process can run meanwhile.

    Made by `SessionStore.create` or `SessionStore.resume`, used in a `with` block.

    Attributes
    ----------
    manifest : SessionManifest
        As it is on disk.
    before : SessionState
        How the session stood before this run.
    run : int
        From 1: how often the session was begun or taken up again, this run included.
    seal : str
        Of the last line of the log that is on disk; empty where an earlier version began it.
    """

    def __init__(
        self, files: SessionFiles, manifest: SessionManifest, *, handle: int, lock: Lock
    ) -> None:
        self.files, self.manifest, self._lock = files, manifest, lock
        self._began_utc, self._began_s = utc_text(), time.monotonic()
        self._tables: list[GrowingTable] = []
        self._opened = False
        try:
            log = read_log(files.log)
            self.before = state_of(log, running=False)
            if log.cut:  # half a line of a process that was killed
                os.ftruncate(handle, os.fstat(handle).st_size - len(log.cut))
            self._cut = log.cut
            self._walls = "Walls" in manifest.rig
            self._hand = self._table("hand", HAND_COLUMNS + WALL_COLUMNS * self._walls)
            self._shown = self._table("presentations", PRESENTATION_COLUMNS)
        except BaseException:
            self._close_tables()
            os.close(handle)
            raise
        self.run = self.before.runs + 1
        seal = None if log.events and not log.seal else log.seal
        self._writer = LogWriter(handle, files.log, first=len(log.events) + 1, seal=seal)

    @classmethod
    def create(
        cls,
        data_folder: str | Path,
        manifest: SessionManifest,
        *,
        overrides: Overrides | None = None,
        texts: TextsByLanguage | None = None,
    ) -> SessionStore:
        """Make the files of a session that has none yet, its manifest before all others.

        Parameters
        ----------
        data_folder : path
            Root of the data set; made if it is not there.
        manifest : SessionManifest
            Written, with what is overridden, and forced to disk before anything is presented.
        overrides : Overrides, optional
            For sessions that go on against a rule.
        texts : mapping of language to mapping of key to text, optional
            What the participant reads, whose hashes the manifest states; written before it.

        Raises
        ------
        InputError
            If the session exists or is being run, comes before its day, or the folder holds data
            of another study, of other models or texts, or of another kind of participants.
        StoreError
            If the disk does not take the files; then there are none.
        """
        overrides = overrides or Overrides()
        files = manifest.files(data_folder)
        try:
            admit(files, manifest, overrides=overrides)
            recorded = [*manifest.overrides]
            recorded += [record for record in overrides.recorded if record not in recorded]
            final = replace(manifest, overrides=tuple(recorded))
            write_texts(files.root, texts or {})
            make_folder(files.folder)
            with locked(files.manifest):
                refuse_begun(files)
                with _claimed(files) as lock:
                    try:
                        return cls._begin(files, final, lock)
                    except BaseException:
                        _remove(files)  # all of them ours, and nothing happened yet
                        raise
        except OSError as error:
            raise store_error(error, files.root, _NOTHING) from error

    @classmethod
    def _begin(cls, files: SessionFiles, manifest: SessionManifest, lock: Lock) -> SessionStore:
        write_new(files.manifest, manifest.to_json().encode())
        handle = open_file(files.log, new=True)
        sync_folder(files.folder)
        store = cls(files, manifest, handle=handle, lock=lock)
        try:
            store._open({"resumed": False, "overrides": manifest.overrides})
            read_log(files.log)  # what could not be read later does not begin
        except BaseException:
            with suppress(StoreError):
                store.close()
            raise
        return store

    @classmethod
    def resume(
        cls,
        data_folder: str | Path,
        manifest: SessionManifest,
        *,
        overrides: Overrides | None = None,
        texts: TextsByLanguage | None = None,
    ) -> SessionStore:
        """Continue with a session that was aborted or interrupted.

        Parameters
        ----------
        manifest : SessionManifest
            As it would be made now. The one on disk, with its order, stays in force; what is
            different now is logged.
        overrides : Overrides, optional
            For sessions that go on against a rule.
        texts : mapping of language to mapping of key to text, optional
            As of `create`.

        Raises
        ------
        InputError
            If there is no such session, it is complete or being run, its log cannot be read, or
            the study, the models, the texts or the kind of participant have changed.
        StoreError
            If the disk does not take it.
        """
        overrides = overrides or Overrides()
        files = manifest.files(data_folder)
        stored = _begun_manifest(files, manifest, overrides=overrides)
        try:
            with _claimed(files) as lock:
                # Killed between manifest and log, it has none yet.
                with locked(files.manifest):
                    handle = open_file(files.log, new=False)
                store = cls(files, stored, handle=handle, lock=lock)
                try:
                    _check_open(store.before, stored, files=files)
                    write_texts(files.root, texts or {})
                    now = {"changed": _changes(stored, manifest), "overrides": overrides.recorded}
                    store._open({"resumed": True, **now})
                except BaseException:
                    with suppress(StoreError):
                        store.close()
                    raise
        except StoreError:
            raise
        except OSError as error:
            raise store_error(error, files.log) from error
        return store

    def _open(self, fields: Mapping[str, object]) -> None:
        cut = {"cut": self._cut.decode("utf-8", "backslashreplace")} if self._cut else {}
        sha256 = self.manifest.sha256
        event = {"manifest_sha256": sha256, **fields, **cut}
        self._writer.put_safely(self._event("opened", event))
        self._opened = True

    @property
    def seal(self) -> str:
        """See the class."""
        return self._writer.seal or ""

    def log(self, event: str, **fields: object) -> None:
        """See `Store.log`."""
        self._writer.put(self._event(event, fields))

    def answer(self, trial: int, row: Mapping[str, object]) -> None:
        """See `Store.answer`.

        Raises
        ------
        ValueError
            For an answer that could not be read again: written, it would cost the whole session.
        """
        if wrong := wrong_in(plain(row), self.files.task):
            raise ValueError(f"expected an answer that can be read again, got {wrong}")
        self._writer.put_safely(self._event("answer", {"trial": trial, "row": dict(row)}))

    def finish(self, status: str, reason: str = "", *, by: str = "") -> None:
        """See `Store.finish`."""
        if status not in SESSION_ENDS:
            raise InputError(
                f"expected {', '.join(SESSION_ENDS)}, got {shown(status)}; choose one."
            )
        fields = {"status": status, "reason": reason, "by": by}
        self._writer.put_safely(self._event("ended", fields))

    def _event(self, event: str, fields: Mapping[str, object]) -> dict[str, object]:
        if not fields.keys().isdisjoint(OWN_FIELDS):
            raise TypeError(f"{event}: {', '.join(OWN_FIELDS)} are reserved names of the log")
        t_s = round(time.monotonic() - self._began_s, 6)
        utc = utc_text()
        if not is_time(utc):  # the clock was set meanwhile, which would cost all answers so far
            utc = utc_text(datetime.fromisoformat(self._began_utc) + timedelta(seconds=t_s))
        values = {"utc": utc, "t_s": t_s, "run": self.run, "event": event, **fields}
        check_event(values)
        return values

    def trace(
        self,
        trial: int,
        rows: HandRows,
        *,
        presentations: Sequence[PresentationRecord],
        faults: Sequence[Fault],
    ) -> None:
        """See `Store.trace`."""
        self._shown.extend(
            presentation_table(trial, presentations, run=self.run, rows=rows, faults=faults)
        )
        self._hand.extend_lines(hand_lines(trial, rows, run=self.run, walls=self._walls))

    def acceleration(self, trial: int, pieces: Sequence[Acceleration]) -> None:
        """See `Store.acceleration`: a WAV file in g for each piece."""
        number = 0
        for piece in pieces:
            number += 1
            while (path := self.files.named(f"trial-{trial:03d}_pen-{number}.wav")).exists():
                number += 1  # of a run that was interrupted in this trial
            try:
                write_bytes(path, pen_file(piece))
            except OSError as error:
                raise store_error(error, path) from error
            self.log("pen", trial=trial, file=path.name, start_s=round(piece.start_s, 6))

    def close(self) -> None:
        """Write what is queued, close the files, and let others run the session.

        The last line of the log holds the SHA-256 of what lies beside it.

        Raises
        ------
        StoreError
            If something queued could not be written.
        """
        self._close_tables()
        opened, self._opened = self._opened, False
        try:
            if opened:
                self.log("stored", files=self._beside_the_log())
        finally:
            try:
                self._writer.close()
            finally:
                self._lock.release()

    def _beside_the_log(self) -> dict[str, str]:
        """SHA-256 of the session's other files by their names, as far as they can be read."""
        paths = (path for path in self.files.there() if path != self.files.log)
        return {Path(path).name: found for path, found in sha256_of_paths(paths).items()}

    def _table(self, name: str, columns: Sequence[Column]) -> GrowingTable:
        described = dump_json(sidecar(columns))
        self.files.named(f"{name}.json").write_text(described, encoding="utf-8")
        table = GrowingTable(self.files.named(f"{name}.tsv"), columns)
        self._tables.append(table)
        return table

    def _close_tables(self) -> None:
        while self._tables:
            self._tables.pop().close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except StoreError:
            if error is None:  # else it would hide what went wrong first
                raise


def _remove(files: SessionFiles) -> None:
    """Remove all files of a session, the manifest last: while it is there, the session is."""
    for path in sorted(files.there(), key=files.manifest.__eq__):
        with suppress(OSError):
            path.unlink()


def require_openable(
    data_folder: str | Path, manifest: SessionManifest, *, overrides: Overrides, resume: bool
) -> SessionManifest:
    """Refuse a session as `SessionStore.create`, or with `resume` as `SessionStore.resume`, would.

    Nothing is written, so that it can be asked before anybody sits down; only opening it keeps
    others from beginning the same session.

    Returns
    -------
    SessionManifest
        The one that would be in force.

    Raises
    ------
    InputError
        Also where what is to be resumed cannot be read to its end.
    """
    files = manifest.files(data_folder)
    if not resume:
        require_admissible(files, manifest, overrides=overrides)
        return manifest
    stored = _begun_manifest(files, manifest, overrides=overrides)
    held = held_session(files)
    with _claimed(files) as lock:
        lock.release()  # nobody runs it
    _check_open(held.state, stored, files=files)
    return stored


def _begun_manifest(
    files: SessionFiles, manifest: SessionManifest, *, overrides: Overrides
) -> SessionManifest:
    """The manifest of a session that was begun, which another one must not contradict."""
    if not files.manifest.exists():
        raise InputError(
            f"expected a session that was begun, got no {files.manifest}; leave out --resume."
        )
    stored = SessionManifest.load(files.manifest)
    _check_unchanged(stored, manifest, files=files, overrides=overrides)
    return stored


@contextmanager
def _claimed(files: SessionFiles) -> Iterator[Lock]:
    """The lock of a session, which stays held unless the block fails."""
    lock = Lock(files.lock)
    try:
        lock.acquire(CLAIM_S)
    except HeldError as holder:
        raise InputError(
            f"expected a session that nobody is running, got {files.stem}, which another console "
            f"runs now ({holder}); wait for its end."
        ) from None
    try:
        yield lock
    except BaseException:
        lock.release()
        raise


def _check_open(state: SessionState, stored: SessionManifest, *, files: SessionFiles) -> None:
    """Refuse to resume what is complete, or whose manifest is not the one that it began with."""
    if state.status == "complete":
        raise InputError(
            f"expected a session to resume, got {files.stem}, which is complete; choose "
            "another subject or session."
        )
    check_named(state.events, files, sha256=stored.sha256)


def _check_unchanged(
    stored: SessionManifest, now: SessionManifest, *, files: SessionFiles, overrides: Overrides
) -> None:
    for name in ("simulated_participant", "simulated_rig", "pilot"):
        if getattr(stored, name) is not getattr(now, name):
            raise InputError(
                f"expected {name} {getattr(stored, name)}, as {files.stem} began, got "
                f"{getattr(now, name)}; go on as it began."
            )
    for what, name, key in (
        ("study", "study_sha256", "study"),
        ("models", "models_sha256", "models_sha256"),
        ("texts", "texts_sha256", "texts_sha256"),
    ):
        recorded = name in stored.values and name in now.values
        if recorded and stored.values[name] != now.values[name]:
            overrides.allow(
                what,
                f"expected the {what} that {files.stem} began with, got another "
                f"{differing(stored.values[key], now.values[key])}; restore what was there",
            )


def _changes(stored: SessionManifest, now: SessionManifest) -> dict[str, Any]:
    """What a manifest would say otherwise today; the order and the reasons are not asked.

    A key that the manifest of an earlier version does not have yet counts as null there.
    """
    kept = ("trials", "overrides")
    return {
        name: value
        for name, value in now.values.items()
        if name not in kept and value != stored.values.get(name)
    }
