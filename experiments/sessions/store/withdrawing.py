"""Deleting all data of a person, and recording dropouts.

docs/method/protocols.md#withdrawing
"""

from __future__ import annotations

import shutil
from pathlib import Path

from tactileq.experiments.sessions.bids.export import Exported, export_all
from tactileq.experiments.sessions.kept.files import require_data_folder, sessions_in
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.state import is_running
from tactileq.modeling import InputError
from tactileq.modeling.files.places import clear_unfinished
from tactileq.modeling.files.writing import write_bytes


def withdraw(data_folder: str | Path, subject: int) -> Exported:
    """Delete all files of a person; the number is never reused, the slot becomes free.

    Begun again after a failure, it continues where it stopped.

    Parameters
    ----------
    data_folder : path
        Root of the data set.

    Returns
    -------
    Exported
        What of the others' tables was made again, and what of theirs is damaged.

    Raises
    ------
    InputError
        If nobody with that number was enrolled, a session of that person is running, there is
        nothing left to delete, or the roster's line of that person cannot be read; then nothing
        was deleted.
    OSError
        If files cannot be deleted.
    """
    root = Path(data_folder)
    _require_still(root, subject)
    roster = Roster(root)
    for folder in (root, roster.path.parent):  # what was killed may have left data of the person
        clear_unfinished(folder)
    left = [folder for folder in _folders(root, subject) if folder.exists()]
    listed = _without(root / "participants.tsv", subject)
    again = roster.subjects().get(subject, {}).get("left") == "withdrawn"
    if not (again and (left or listed)):
        roster.withdraw(subject)
    # What the others are made from goes first, so that nothing is made again in between.
    for folder in left:
        shutil.rmtree(folder)
    if listed is not None:
        write_bytes(root / "participants.tsv", listed)
    return export_all(root)


def drop_out(data_folder: str | Path, subject: int) -> Exported:
    """Record that a person dropped out: the data stay, the slot becomes free.

    Returns
    -------
    Exported
        As of `withdraw`.

    Raises
    ------
    InputError
        If nobody with that number takes part, or a session of that person is running.
    """
    root = Path(data_folder)
    _require_still(root, subject)
    Roster(root).drop(subject)
    return export_all(root)


def files_of(data_folder: str | Path, subject: int) -> tuple[Path, ...]:
    """All files of a person."""
    folders = _folders(Path(data_folder), subject)
    found = (path for folder in folders for path in folder.rglob("*") if not path.is_dir())
    return tuple(sorted(found))


def _without(table: Path, subject: int) -> bytes | None:
    """The table of participants without this person; None where the person is not in it."""
    if not table.is_file():
        return None
    lines = table.read_bytes().splitlines(keepends=True)
    kept = [line for line in lines if not line.startswith(f"sub-{subject:02d}\t".encode())]
    return b"".join(kept) if len(kept) < len(lines) else None


def _folders(root: Path, subject: int) -> tuple[Path, Path]:
    name = f"sub-{subject:02d}"
    return root / "sourcedata" / name, root / name


def _require_still(root: Path, subject: int) -> None:
    require_data_folder(root)
    for files in sessions_in(root):
        if files.subject == subject and is_running(files.log):
            raise InputError(
                f"expected no running session of subject {subject}, got {files.stem}, which a "
                "console runs now; end it first."
            )
