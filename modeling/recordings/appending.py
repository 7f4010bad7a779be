"""Recordings added to a folder's: nothing in it is written again, and WAV files stay WAV files."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.folders import check_replaceable, replace_folder
from tactileq.modeling.files.places import behind_links, is_hidden, locked, unfinished_folder
from tactileq.modeling.files.reading import reason_of
from tactileq.modeling.files.syncing import sync_file, sync_folder
from tactileq.modeling.files.tables import read_cells, table_text
from tactileq.modeling.files.wav import mended_wav
from tactileq.modeling.files.writing import write_files, write_text
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.recording_set import (
    INDEX_NAME,
    RecordingSet,
    check_rounding,
    index_row,
    listed,
    stated,
    write_samples,
)

# Names the files that an addition is about to write; gone once the index lists them.
UNFINISHED_NAME = ".unfinished"
_OWN_NAME = re.compile(r"(\d{4,})\.(csv|wav)")


@dataclass(frozen=True)
class WavSource:
    """The WAV file that a recording's samples were read from.

    Parameters
    ----------
    channel : int
        From 1.
    g_per_fullscale : float, optional
        What the samples were multiplied by; without it their unit is `arbitrary`.
    """

    path: Path
    channel: int = 1
    g_per_fullscale: float | None = None


def append(
    folder: str | Path,
    recordings: RecordingSet,
    sources: Sequence[WavSource | None],
    *,
    beside: Mapping[str, bytes] | None = None,
) -> int:
    """Add recordings to a folder's at once: `staged`, then `Staged.add`; how many it holds now."""
    with staged(folder, recordings, sources) as ready, locked(folder):
        return ready.add(beside or {})


@dataclass(frozen=True)
class Staged:
    """Recordings that are written already, and only have to be moved into a folder."""

    folder: Path
    recordings: RecordingSet
    files: tuple[Path, ...]
    rows: tuple[dict[str, object], ...]

    def add(self, beside: Mapping[str, bytes]) -> int:
        """Add them to the folder's; one that is not there yet is made.

        Files of earlier recordings are not touched, and the index that lists the new ones takes the
        place of the old one last: whatever ends this earlier, the set is as it was, and the next
        addition removes what was left behind. Whoever may add at the same time must hold the lock
        of the folder (`places.locked`).

        Parameters
        ----------
        beside : mapping of name to contents
            Files that take their places together with the index, such as provenance.

        Returns
        -------
        int
            How many recordings the set holds now.

        Raises
        ------
        InputError
            As `staged`.
        """
        with _refusals_in_one_sentence(self.folder):
            if (self.folder / INDEX_NAME).is_file():
                return self._move(self.folder, beside)
            seen = check_replaceable(self.folder, index_name=INDEX_NAME, what="a recording set")
            with replace_folder(self.folder, seen) as fresh:
                return self._move(fresh, beside)

    def _move(self, folder: Path, beside: Mapping[str, bytes]) -> int:
        index = folder / INDEX_NAME
        known = listed(folder) if index.is_file() else []
        _check_conditions(folder, known, self.recordings)
        _remove_unfinished(folder)
        names = _new_names(folder, known, self.files)
        try:
            write_text(folder / UNFINISHED_NAME, "\n".join(names) + "\n")
            for file, name in zip(self.files, names, strict=True):
                file.rename(folder / name)
            sync_folder(folder)
            rows = [{**row, "file": name} for row, name in zip(self.rows, names, strict=True)]
            others = {folder / name: data for name, data in beside.items()}
            write_files({**others, index: _index_text(index, rows).encode()})
        finally:
            _remove_unfinished(folder)
        return len(known) + len(rows)


@contextmanager
def staged(
    folder: str | Path, recordings: RecordingSet, sources: Sequence[WavSource | None]
) -> Iterator[Staged]:
    """Write recordings for a folder, forced to disk, without locking the folder meanwhile.

    Parameters
    ----------
    sources : sequence of WavSource or None
        For each recording the file to copy into the set, or None: then it becomes a CSV file.

    Raises
    ------
    InputError
        For a condition that the set holds already, a folder with other contents than a set, and a
        disk that takes no more.
    """
    target = Path(folder)
    with ExitStack() as stack:
        with _refusals_in_one_sentence(target):
            if there := (target / INDEX_NAME).is_file():
                _check_conditions(target, listed(target), recordings)
            else:
                _check_new(target)
            place = target / INDEX_NAME if there else behind_links(target)
            hidden = stack.enter_context(unfinished_folder(place))
            files = [
                hidden / f"{number}.{'csv' if source is None else 'wav'}"
                for number, source in enumerate(sources)
            ]
            rows = [
                _write(file, recording, source)
                for file, recording, source in zip(files, recordings, sources, strict=True)
            ]
        yield Staged(target, recordings, tuple(files), tuple(rows))


def _check_new(target: Path) -> None:
    """Refuse a folder with other files in it, unless it has become a set meanwhile: then they may
    be those of somebody who adds to it just now."""
    try:
        check_replaceable(target, index_name=INDEX_NAME, what="a recording set")
    except InputError:
        if not (target / INDEX_NAME).is_file():
            raise


@contextmanager
def _refusals_in_one_sentence(target: Path) -> Iterator[None]:
    """The disk's refusal, as one sentence."""
    try:
        yield
    except OSError as error:
        named = Path(error.filename or "")
        where = f" at {named}" if named.parts and not any(map(is_hidden, named.parts)) else ""
        raise InputError(
            f"expected to add recordings to {target}, got {reason_of(error)}{where}, so it "
            "is as it was; check the path, its permissions and the space on the disk."
        ) from None


def _check_conditions(
    folder: Path, known: Iterable[dict[str, str]], recordings: RecordingSet
) -> None:
    """Refuse a second recording of a condition, or of one that differs by rounding only, by the
    index; no samples are read."""
    taken = {
        (row["texture"], row["speed_mm_s"], row["force_n"], row["repeat"] or 1)
        for row in (stated(folder, cells) for cells in known)
    }
    for recording in recordings:
        if (recording.texture, *recording.condition, recording.repeat) in taken:
            raise InputError(
                f"expected one recording per condition, got two of {recording.describe()}, one of "
                "them in the set already; leave it out, or number real repetitions in the column "
                "'repeat'."
            )
    check_rounding(
        [*(place[:3] for place in taken), *((r.texture, *r.condition) for r in recordings)]
    )


def _remove_unfinished(folder: Path) -> None:
    """Remove the files of an addition that did not finish, and its note."""
    note, index = folder / UNFINISHED_NAME, folder / INDEX_NAME
    # Without the index nobody knows which files are recordings.
    if not (note.is_file() and index.is_file()):
        return
    listed_names = {row["file"] for _, row in read_cells(index, [Column("file")])}
    for name in note.read_text(encoding="utf-8").split("\n"):
        if _OWN_NAME.fullmatch(name) and name not in listed_names:
            (folder / name).unlink(missing_ok=True)
    note.unlink()


def _new_names(folder: Path, known: Iterable[dict[str, str]], files: Iterable[Path]) -> list[str]:
    """Names that neither the index nor anything else in the folder has."""
    names = [row["file"] for row in known] + [path.name for path in folder.iterdir()]
    last = max((int(found[1]) for name in names if (found := _OWN_NAME.fullmatch(name))), default=0)
    return [f"{place:04d}{file.suffix}" for place, file in enumerate(files, start=last + 1)]


def _write(path: Path, recording: Recording, source: WavSource | None) -> dict[str, object]:
    """Write a recording's file, forced to disk; its row of the index."""
    row = {"file": path.name, **index_row(recording)}
    if source is None:
        write_samples(path, recording)
        sync_file(path)
        return row
    if (mended := mended_wav(source.path)) is None:
        shutil.copyfile(source.path, path)
    else:
        path.write_bytes(mended)
    sync_file(path)
    return row | {"g_per_fullscale": source.g_per_fullscale, "channel": source.channel}


def _index_text(index: Path, added: Sequence[dict[str, object]]) -> str:
    """The rows that were there, as they were, and the new ones; columns are those of both."""
    there = read_cells(index, ()) if index.is_file() else ()
    rows: list[Mapping[str, object]] = [*(row for _, row in there), *added]
    columns = [Column(name) for name in dict.fromkeys(name for row in rows for name in row)]
    return table_text(columns, rows, missing="")
