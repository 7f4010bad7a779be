"""Pieces of strokes on the disk, and the recordings made from them; no stored piece is lost.

docs/method/strokes.md#files
"""

from __future__ import annotations

import io
import re
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from tactileq.modeling import Recording, RecordingSet
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_duration, check_texture_name
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import Column, chosen, names
from tactileq.modeling.files.folders import folder_behind
from tactileq.modeling.files.places import clear_unfinished, locked
from tactileq.modeling.files.provenance import PROVENANCE_NAME, provenance_text
from tactileq.modeling.files.reading import read_text
from tactileq.modeling.files.tables import read_cells, table_text, typed
from tactileq.modeling.files.wav import read_wav
from tactileq.modeling.files.writing import write_files
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.appending import WavSource, append
from tactileq.modeling.recordings.recording_set import INDEX_COLUMNS
from tactileq.rig.recording.capture.coverage import Coverage
from tactileq.rig.recording.capture.cutting import SHORTEST_PART_S, StrokePart
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.joining import joined, joined_samples
from tactileq.rig.recording.capture.recorded import (
    begin_index,
    check_continues,
    recorded_conditions,
    unusable_recordings,
)

PIECES = "pieces"
TABLE_NAME = "pieces.tsv"
PIECE_COLUMNS = (
    Column("file", description="Name of the WAV file in the folder", required=True),
    Column("texture", description="Name of the surface", required=True),
    *chosen(INDEX_COLUMNS, "speed_mm_s", "force_n"),
    *(
        replace(column, optional=False, required=True)
        for column in chosen(INDEX_COLUMNS, "repeat", "rate_hz", "samples")
    ),
    *(
        Column(
            name, unit=unit, description=description, limits=(-inf, inf), nan=True, optional=True
        )
        for name, unit, description in (
            ("mean_speed_mm_s", "mm/s", "Mean speed of the hand"),
            ("speed_sd_mm_s", "mm/s", "Standard deviation of its speed"),
            ("mean_force_n", "N", "Mean force"),
            ("force_sd_n", "N", "Standard deviation of the force"),
        )
    ),
    Column(
        "simulated",
        description="Whether the hand or the input was simulated",
        levels={"true": "simulated", "false": "recorded"},
        required=True,
    ),
    Column(
        "force_assumed",
        description="Whether the force was not measured but assumed",
        levels={"true": "assumed", "false": "measured"},
        optional=True,
    ),
)


@dataclass(frozen=True)
class Plan:
    """What a folder is to hold.

    Parameters
    ----------
    wanted_s : float
        Of each condition, at least twice the shortest piece (0.2 s).
    repeat : int
        1 for the first record of each condition.
    simulated : bool
        Whether the input is a simulation, whatever the hand is.
    """

    texture: str
    grid: StrokeGrid
    rate_hz: float
    wanted_s: float = 1.0
    repeat: int = 1
    simulated: bool = False

    def __post_init__(self) -> None:
        check_texture_name(self.texture)
        check_duration(self.wanted_s, self.rate_hz)
        if self.wanted_s < 2 * SHORTEST_PART_S:
            raise InputError(
                f"expected at least {2 * SHORTEST_PART_S:g} s of each condition, got "
                f"{self.wanted_s:g} s; record longer."
            )

    @property
    def wanted_samples(self) -> int:
        """Length of each recording."""
        return round(self.wanted_s * self.rate_hz)


@dataclass(frozen=True)
class _Kept:
    """A row of the table of pieces: of this texture, repeat and rate."""

    file: str
    condition: Condition
    samples: int
    simulated: bool


class PieceStore:
    """A folder of recordings that is filled by strokes; opened again, it continues.

    Each piece is a file of its own as soon as it is cut. Once the pieces of a condition suffice,
    they are joined into its recording, so that the folder is a recording set at any time.

    Parameters
    ----------
    folder : str or Path
        A new one, one that was filled so before, or another recording set.
    provenance : mapping
        Of this run; it goes beside the recordings.

    Raises
    ------
    InputError
        For a folder that holds something else, or pieces at another rate.
    """

    def __init__(
        self, folder: str | Path, plan: Plan, *, provenance: Mapping[str, Any] | None = None
    ) -> None:
        self.folder = folder_behind(folder)
        self.plan = plan
        self._provenance = dict(provenance or {})
        self._kept: list[_Kept] = []
        self.damaged: list[str] = []  # a sentence for each file that does not count
        self.counts = Counter(kept=0, clipped=0, silent=0, surplus=0)
        check_continues(self.folder, PIECES)
        clear_unfinished(self.folder / PIECES)
        self._read()
        # A run that was killed may have ended between a last piece and its recording.
        for condition in self._filled():
            self._record(condition)

    @property
    def coverage(self) -> Coverage:
        """Seconds of every cell; a recorded one is full."""
        seconds = {
            condition: joined_samples(sizes, self.plan.rate_hz) / self.plan.rate_hz
            for condition, sizes in self._sizes().items()
        }
        full = dict.fromkeys(self._recorded, self.plan.wanted_s)
        return Coverage(self.plan.grid, self.plan.wanted_s, seconds=seconds | full)

    @property
    def conditions_recorded(self) -> int:
        """How many cells of the grid have their recording."""
        return len(self._recorded & set(self.plan.grid.conditions))

    @property
    def simulated(self) -> bool:
        """Whether any piece of this repeat is."""
        return self.plan.simulated or any(one.simulated for one in self._kept)

    def add(self, piece: StrokePart) -> bool:
        """Keep a piece; its condition's recording is made once there is enough of it.

        Returns
        -------
        bool
            False where the condition is full already, or the piece clipped or silent: it is not
            kept.
        """
        surplus = piece.condition in self._recorded
        if piece.clipped or piece.silent or surplus:
            why = "clipped" if piece.clipped else "silent" if piece.silent else "surplus"
            self.counts[why] += 1
            return False
        self._begin_index()
        with locked(self.folder / PIECES / TABLE_NAME) as table:
            rows: list[Mapping[str, object]] = [row for _, row in _rows(table)]
            file = _new_name(table.parent, rows)
            rows.append(self._row(file, piece))
            text = table_text(PIECE_COLUMNS, rows, missing="")
            # The table last, once the piece is on disk for good.
            write_files(
                {
                    table.with_name(file): _wav(piece.samples_g, self.plan.rate_hz),
                    table: text.encode(),
                }
            )
        self.counts["kept"] += 1
        self._kept.append(
            _Kept(
                file,
                piece.condition,
                piece.samples_g.size,
                simulated=piece.simulated or self.plan.simulated,
            )
        )
        if piece.condition in self._filled():
            self._record(piece.condition)
        return True

    def finish(self, about: Mapping[str, Any]) -> None:
        """Write this run's counts, and more about it, beside the recordings that it made."""
        note = self.folder / PROVENANCE_NAME
        if self.counts["kept"] and note.is_file():
            write_files({note: self._note(about)})

    def _note(self, about: Mapping[str, Any] | None = None) -> bytes:
        stated = {**self._provenance, "pieces": dict(self.counts), **(about or {})}
        return provenance_text(stated).encode()

    def _begin_index(self) -> None:
        if lost := begin_index(self.folder):
            self.damaged.append(
                f"{lost}; restore it from a copy, or what there are pieces of is recorded again "
                "under new names."
            )

    def _read(self) -> None:
        table = self.folder / PIECES / TABLE_NAME
        rows = _rows(table)
        listed_files = {row["file"] for _, row in rows}
        # A run that was killed may have ended between its last piece and the table.
        lost = _files(table.parent) - listed_files
        if lost - ({_name_after(listed_files)} if rows else set()):
            self.damaged.append(
                f"expected each piece in {table}, got {len(lost)} that it does not list, such as "
                f"{min(lost)}, of unknown speed and force; restore the table from a copy, or "
                "stroke there again."
            )
        for where, cells in rows:
            row: dict[str, Any] = dict(typed(cells, PIECE_COLUMNS, where))
            if row["texture"] != self.plan.texture:
                continue
            if (rate_hz := row["rate_hz"]) != self.plan.rate_hz:
                raise InputError(
                    f"expected pieces of {self.plan.rate_hz:g} Hz in {self.folder}, got some of "
                    f"{rate_hz:g} Hz; go on at that rate (--rate {rate_hz:g}), or choose another "
                    "folder."
                )
            if row["repeat"] == self.plan.repeat:
                self._keep_whole(_kept(row))
        self._recorded = recorded_conditions(self.folder, self.plan.texture, self.plan.repeat)
        if self._recorded:
            self.damaged += unusable_recordings(self.folder, self.plan.texture)

    def _keep_whole(self, one: _Kept) -> None:
        """Count a piece of an earlier run, unless its file is damaged."""
        try:
            self._samples(one)
        except InputError as error:
            self.damaged.append(str(error))
        else:
            self._kept.append(one)

    def _samples(self, one: _Kept) -> Floats:
        samples = read_wav(self.folder / PIECES / one.file)[0]
        if samples.size != one.samples:
            raise InputError(
                f"expected {one.samples} samples in {self.folder / PIECES / one.file}, got "
                f"{samples.size}; the file is damaged and does not count, stroke there again."
            )
        return samples

    def _sizes(self) -> dict[Condition, list[int]]:
        sizes: dict[Condition, list[int]] = {}
        for one in self._kept:
            sizes.setdefault(one.condition, []).append(one.samples)
        return sizes

    def _filled(self) -> list[Condition]:
        """Conditions with enough pieces, and no recording yet."""
        return [
            condition
            for condition, sizes in self._sizes().items()
            if condition not in self._recorded
            and joined_samples(sizes, self.plan.rate_hz) >= self.plan.wanted_samples
        ]

    def _record(self, condition: Condition) -> None:
        """Join the pieces of a condition, and add its recording to the set."""
        self._begin_index()
        chosen = [one for one in self._kept if one.condition == condition]
        samples = self._joined(chosen)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "joined.wav"
            path.write_bytes(_wav(samples, self.plan.rate_hz))
            record = Recording(
                read_wav(path)[0],
                self.plan.rate_hz,
                *condition,
                self.plan.texture,
                simulated=any(one.simulated for one in chosen),
                repeat=self.plan.repeat,
                clipped_share=0.0,  # clipped pieces are not kept
            )
            beside = {PROVENANCE_NAME: self._note()}
            source = WavSource(path, 1, 1.0)
            append(self.folder, RecordingSet([record]), [source], beside=beside)
        self._recorded.add(condition)

    def _joined(self, chosen: Sequence[_Kept]) -> Floats:
        pieces = [self._samples(one) for one in chosen]
        return joined(pieces, self.plan.rate_hz)[: self.plan.wanted_samples]

    def _row(self, name: str, piece: StrokePart) -> dict[str, object]:
        values = (
            *(name, self.plan.texture, *piece.condition, self.plan.repeat),
            *(self.plan.rate_hz, piece.samples_g.size),
            *(f"{piece.mean_speed_mm_s:.4g}", f"{piece.speed_sd_mm_s:.4g}"),
            *(f"{piece.mean_force_n:.4g}", f"{piece.force_sd_n:.4g}"),
            *(bool(piece.simulated or self.plan.simulated), bool(piece.force_assumed)),
        )
        return dict(zip(names(PIECE_COLUMNS), values, strict=True))


def _rows(table: Path) -> list[tuple[str, dict[str, str]]]:
    """The rows as text, each with its place; numbers stay as they were written."""
    if not table.is_file():
        return []
    rows = read_cells(table, PIECE_COLUMNS)
    if last := read_text(table, "a table").rpartition("\n")[2]:
        raise InputError(
            f"expected {table} to end with a whole line, got {shown(last)} at its end; the "
            "table is truncated, restore it from a copy, or remove that line."
        )
    for _, row in rows:
        _check_name(row["file"], table)
    return rows


def _new_name(folder: Path, rows: Sequence[Mapping[str, object]]) -> str:
    """A name that neither the table nor a file has, since a file that is not listed may be data."""
    return _name_after({str(row["file"]) for row in rows} | _files(folder))


def _name_after(names: Iterable[str]) -> str:
    last = max((int(Path(name).stem) for name in names), default=0)
    return f"{last + 1:05d}.wav"


def _files(folder: Path) -> set[str]:
    """Names of the pieces in a folder, listed or not."""
    return {path.name for path in folder.glob("*.wav") if _is_piece(path.name)}


def _kept(row: Mapping[str, Any]) -> _Kept:
    return _Kept(
        row["file"],
        _condition(row),
        row["samples"],
        simulated=row["simulated"] != "false",
    )


def _check_name(name: str, table: Path) -> None:
    """Refuse a file that no piece can be in: names are numbers, and lead nowhere else."""
    if not _is_piece(name):
        raise InputError(
            f"expected a file such as 00001.wav in {table}, got {shown(name)}; remove the line."
        )


def _is_piece(name: str) -> bool:
    return re.fullmatch(r"[0-9]{1,9}\.wav", name) is not None


def _condition(row: Mapping[str, Any]) -> Condition:
    return row["speed_mm_s"], row["force_n"]


def _wav(samples: Floats, rate_hz: float) -> bytes:
    """A WAV file of single precision, as the card gives it."""
    from scipy.io import wavfile

    buffer = io.BytesIO()
    wavfile.write(buffer, round(rate_hz), samples.astype(np.float32))
    return buffer.getvalue()
