"""Where the files of a session are."""

from __future__ import annotations

import errno
import os
import re
from dataclasses import dataclass
from pathlib import Path

from tactileq.modeling import InputError
from tactileq.modeling.errors import shortened
from tactileq.modeling.files.places import LOCK_NAME
from tactileq.modeling.files.reading import LONGEST_PATH
from tactileq.modeling.files.writing import write_bytes

# Endings of what a session writes beside its manifest and its log.
_BESIDE = re.compile(r"(?:hand|presentations)\.(?:tsv|json)|trial-\d{3,}_pen-\d+\.wav")
_MANIFEST = re.compile(r"sub-(\d+)_ses-(\d+)_task-([A-Za-z]+)_manifest\.json")


@dataclass(frozen=True, kw_only=True)
class SessionFiles:
    """The files of one session, be they there or not.

    Parameters
    ----------
    root : Path
        Of the data set.
    subject, session : int
        From 1.
    """

    root: Path
    task: str
    subject: int
    session: int

    @property
    def stem(self) -> str:
        """Beginning of their names, as sub-01_ses-01_task-absolute."""
        return f"{self.participant}_{self.session_id}_task-{self.task}"

    @property
    def participant(self) -> str:
        """As sub-01."""
        return f"sub-{self.subject:02d}"

    @property
    def session_id(self) -> str:
        """As ses-01."""
        return f"ses-{self.session:02d}"

    @property
    def beh(self) -> Path:
        """The folder in which BIDS shows them."""
        return self.root / self.participant / self.session_id / "beh"

    @property
    def answers(self) -> Path:
        """The table of answers in it."""
        return self.beh / f"{self.stem}_beh.tsv"

    @property
    def folder(self) -> Path:
        """The folder that they are in."""
        return self.root / "sourcedata" / self.participant / self.session_id

    @property
    def lock(self) -> Path:
        """What the process that runs it holds, there while it does."""
        return lock_of(self.log)

    def named(self, ending: str) -> Path:
        """The file with this ending, such as "hand.tsv"."""
        return self.folder / f"{self.stem}_{ending}"

    @property
    def manifest(self) -> Path:
        """What was fixed before the first trial."""
        return self.named("manifest.json")

    @property
    def log(self) -> Path:
        """What happened."""
        return self.named("log.jsonl")

    def there(self) -> list[Path]:
        """All of them that are there."""
        return sorted(self.folder.glob(f"{self.stem}_*"))

    def beside(self) -> list[Path]:
        """Those beside manifest and log that are there and that sessions write; no others'."""
        start = len(self.stem) + 1
        return [path for path in self.there() if _BESIDE.fullmatch(path.name[start:])]

    @staticmethod
    def of_manifest(path: Path) -> SessionFiles | None:
        """The files of the session that has its manifest there; None for any other name."""
        match = _MANIFEST.fullmatch(path.name)
        if not match:
            return None
        subject, session, task = int(match[1]), int(match[2]), match[3]
        files = SessionFiles(root=path.parents[3], task=task, subject=subject, session=session)
        return files if files.manifest == path else None


def lock_of(log: Path) -> Path:
    """The lock file of the session with this log; hidden, since it is none of its data."""
    return log.with_name(f".{log.stem}{LOCK_NAME}")


def sessions_in(data_folder: str | Path) -> tuple[SessionFiles, ...]:
    """The sessions of a data set that have a manifest, by subject, session and task."""
    found = Path(data_folder).glob("sourcedata/sub-*/ses-*/*_manifest.json")
    sessions = [files for path in found if (files := SessionFiles.of_manifest(path))]
    return tuple(sorted(sessions, key=lambda f: (f.subject, f.session, f.task)))


def open_file(path: Path, *, new: bool) -> int:
    """A handle to append to a file: one that must not be there yet, or one that may.

    Who else may write to it is for the mask to say, as of all files: a laboratory shares a folder.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
    return os.open(path, flags | (os.O_EXCL if new else 0), 0o666)


def write_all(handle: int, data: bytes) -> None:
    """Write all of it, however little the system takes at a time."""
    while data:
        data = data[os.write(handle, data) :]


def write_new(path: Path, data: bytes) -> None:
    """Write a file that is not there yet, whole and forced to disk.

    Whoever may write the same one at the same time must hold the lock of its folder.

    Raises
    ------
    OSError
        FileExistsError where it is there.
    """
    if os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    write_bytes(path, data)


def require_data_folder(root: Path) -> None:
    """InputError where there is no such folder."""
    if not root.is_dir():
        raise InputError(
            "expected the data folder of a study, got none at "
            f"{shortened(str(root), longest=LONGEST_PATH)}; the first session makes it, or name "
            "another with --data."
        )
