"""Sets of recordings, in memory and as folders."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from math import inf, isclose, nan
from pathlib import Path
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import (
    HIGHEST_FORCE_N,
    HIGHEST_RATE_HZ,
    HIGHEST_SPEED_MM_S,
    LOWEST_RATE_HZ,
)
from tactileq.modeling.errors import InputError, counted, shortened, shown
from tactileq.modeling.files.columns import ABOVE_0, Column, chosen, number_in
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.folders import check_replaceable, listed_file, replace_folder
from tactileq.modeling.files.places import matching
from tactileq.modeling.files.reading import read_text
from tactileq.modeling.files.tables import read_cells, typed, write_table
from tactileq.modeling.files.wav import read_wav
from tactileq.modeling.recordings.recording import Recording

INDEX_NAME = "recordings.tsv"
INDEX_COLUMNS = (
    Column("file", description="Name of the CSV or WAV file in the folder", required=True),
    Column("texture", description="Name of the surface; where empty, that of the folder"),
    Column(
        "speed_mm_s",
        unit="mm/s",
        description="Tangential speed of the hand",
        limits=(0, HIGHEST_SPEED_MM_S),
        required=True,
    ),
    Column(
        "force_n", unit="N", description="Normal force", limits=(0, HIGHEST_FORCE_N), required=True
    ),
    Column(
        "rate_hz",
        unit="Hz",
        description="Sampling rate; a CSV file needs it, a WAV file states its own",
        limits=(LOWEST_RATE_HZ, HIGHEST_RATE_HZ),
        optional=True,
    ),
    Column(
        "unit", description="g, or arbitrary where nobody calibrated, as without it", optional=True
    ),
    Column(
        "repeat",
        description="Which recording of its condition, from 1, as without it",
        limits=(1, inf),
        whole=True,
        optional=True,
    ),
    Column(
        "simulated",
        description="Whether it was simulated",
        levels={"true": "simulated", "false": "recorded, as without it"},
        optional=True,
    ),
    Column(
        "samples",
        description="How many there are, by which a truncated file is found",
        limits=(1, inf),
        whole=True,
        optional=True,
    ),
    Column(
        "clipped_share",
        description="Share of clipped samples; without it they are counted",
        limits=(0, 1),
        nan=True,
        optional=True,
    ),
)
# What the index says of WAV files beside that; empty for CSV files.
WAV_COLUMNS = (
    Column(
        "g_per_fullscale",
        unit="g",
        description="Acceleration of a full-scale sample; the unit is then g",
        limits=(ABOVE_0, inf),
        optional=True,
    ),
    Column(
        "channel",
        description="Of a file with several channels, from 1",
        limits=(1, inf),
        whole=True,
        optional=True,
    ),
)
KNOWN_COLUMNS = INDEX_COLUMNS + WAV_COLUMNS
# Speeds, or forces, whose relative difference is smaller are the same but for rounding.
ROUNDING = 1e-6


class RecordingSet:
    """The recordings of one or more textures; at most one per texture, condition and repeat.

    Parameters
    ----------
    recordings : iterable of Recording
        At least one.

    Raises
    ------
    InputError
        If there is none, if two stand for the same condition, or if conditions of a texture differ
        by rounding only.
    """

    def __init__(self, recordings: Iterable[Recording]) -> None:
        self.recordings = tuple(recordings)
        if not self.recordings:
            raise InputError("expected at least one recording, got none; record or import some.")
        seen: set[tuple[Any, ...]] = set()
        for recording in self.recordings:
            key = (recording.texture, *recording.condition, recording.repeat)
            if key in seen:
                raise InputError(
                    f"expected one recording per condition, got two of {recording.describe()}; "
                    "remove one, or number real repetitions in the column 'repeat'."
                )
            seen.add(key)
        check_rounding((r.texture, *r.condition) for r in self.recordings)

    def __len__(self) -> int:
        return len(self.recordings)

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.recordings)

    def __repr__(self) -> str:
        return f"<RecordingSet of {counted(len(self), 'recording')} of {', '.join(self.textures)}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RecordingSet):
            return NotImplemented
        return self.recordings == other.recordings

    __hash__ = None  # type: ignore[assignment]

    @property
    def textures(self) -> tuple[str, ...]:
        """Names of the textures, in the order of their first recording."""
        return tuple(dict.fromkeys(r.texture for r in self.recordings))

    @property
    def texture(self) -> str:
        """The name of the only texture; InputError where there are several."""
        if len(self.textures) > 1:
            raise InputError(
                f"expected recordings of one texture, got {', '.join(self.textures)}; "
                "choose one with .of_texture(name)."
            )
        return self.textures[0]

    def of_texture(self, texture: str) -> RecordingSet:
        """The recordings of one texture."""
        return RecordingSet(r for r in self.recordings if r.texture == texture)

    def save(self, folder: str | Path) -> None:
        """Write `recordings.tsv` and one CSV per condition; the folder appears whole or not at all.

        Raises
        ------
        InputError
            If the folder exists and holds something else than a recording set.
        """
        target = Path(folder)
        seen = check_replaceable(target, index_name=INDEX_NAME, what="a recording set")
        with replace_folder(target, seen) as fresh:
            rows = []
            for number, recording in enumerate(self.recordings, start=1):
                name = f"{number:04d}.csv"
                write_samples(fresh / name, recording)
                rows.append({"file": name, **index_row(recording)})
            write_table(fresh / INDEX_NAME, INDEX_COLUMNS, rows)

    @staticmethod
    def load(folder: str | Path, *, texture: str | None = None) -> RecordingSet:
        """Read a folder with `recordings.tsv` (CSV or WAV files), or WAV files with JSON sidecars.

        Parameters
        ----------
        texture : str, optional
            The only texture whose files are read; all of them without it.

        Raises
        ------
        InputError
            With the file's name, for a folder that is not one and for any unusable record.
        """
        rows = [r for r in listed(Path(folder)) if texture in (None, r["texture"])]
        if texture is not None and not rows:
            raise InputError(
                f"expected a recording of {shown(texture)} in {folder}, got none; choose another "
                "texture or record this one."
            )
        return RecordingSet(_load_row(Path(folder), row) for row in rows)


def check_rounding(places: Iterable[tuple[str, float, float]]) -> None:
    """Refuse conditions of a texture that differ, but in speed and force by less than a millionth.

    They would count as two conditions of one grid. `places`: texture, speed (mm/s), force (N).
    """
    ordered = sorted(set(places))
    for later, (texture, speed, force) in enumerate(ordered, start=1):
        for name, other_speed, other_force in islice(ordered, later, None):
            if name != texture or not isclose(speed, other_speed, rel_tol=ROUNDING):
                break
            if isclose(force, other_force, rel_tol=ROUNDING):
                raise InputError(
                    f"{shown(texture)}: expected conditions that are equal or differ by more than "
                    f"rounding, got {speed!r} mm/s, {force!r} N and {other_speed!r} mm/s, "
                    f"{other_force!r} N; write the same for both, and number real repetitions in "
                    "the column 'repeat'."
                )


def load_usable(
    folder: str | Path, *, texture: str | None = None
) -> tuple[RecordingSet, tuple[str, ...]]:
    """As `RecordingSet.load`, but unusable records are left out, with a stated_cells for each.

    Raises
    ------
    InputError
        For a folder that is no recording set, and where no record can be used: what is wrong with
        the first.
    """
    records, refusals = [], []
    for row in listed(Path(folder)):
        if texture not in (None, row["texture"]):
            continue
        try:
            records.append(_load_row(Path(folder), row))
        except InputError as error:
            refusals.append(error)
    if refusals and not records:
        raise refusals[0]
    return RecordingSet(records), tuple(map(str, refusals))


def is_recording_set(folder: Path) -> bool:
    """Whether `RecordingSet.load` finds anything in this folder."""
    return (folder / INDEX_NAME).is_file() or bool(_sidecar_files(folder))


def recording_folders(folder: Path) -> list[Path]:
    """The folder itself where it is a recording set, else its sub-folders that are, by name."""
    if is_recording_set(folder) or not folder.is_dir():
        return [folder]
    below = [path for path in matching(folder, "*") if path.is_dir() and is_recording_set(path)]
    return below or [folder]


def textures_in(folder: str | Path) -> tuple[str, ...]:
    """Names of the textures that a folder lists (none in an empty list); no samples are read."""
    return tuple(dict.fromkeys(row["texture"] for row in listed(Path(folder))))


def listed(folder: Path) -> list[dict[str, str]]:
    """One row of text per recording of a folder, each with its texture (else the folder's name)."""
    if not folder.is_dir():
        raise InputError(
            f"expected a folder of recordings, got {folder}; give a folder that holds {INDEX_NAME}."
        )
    if (folder / INDEX_NAME).is_file():
        rows = [row for _, row in read_cells(folder / INDEX_NAME, KNOWN_COLUMNS)]
        _check_files(rows, folder / INDEX_NAME)
    elif not (rows := [_sidecar_row(path) for path in _sidecar_files(folder)]):
        raise InputError(
            f"expected {INDEX_NAME} (or WAV files with JSON sidecars) in {folder}, got neither; "
            "import the files first (tactileq import wav|csv)."
        )
    return [{**row, "texture": row.get("texture") or folder.name} for row in rows]


def _check_files(rows: Sequence[Mapping[str, str]], index: Path) -> None:
    """Refuse a file that stands for two recordings."""
    files = [(row["file"], row.get("channel", "")) for row in rows]
    for place, (name, channel) in enumerate(files):
        if (name, channel) in files[:place]:
            raise InputError(
                f"expected each file once in {index}, got {shown(name)} twice; remove the wrong "
                "row."
            )


def _sidecar_files(folder: Path) -> list[Path]:
    return [p for p in matching(folder, "*.wav") if p.with_suffix(".json").is_file()]


def index_row(recording: Recording) -> dict[str, object]:
    """What the index says of a recording beside its file."""
    return {
        "texture": recording.texture,
        "speed_mm_s": recording.speed_mm_s,
        "force_n": recording.force_n,
        "rate_hz": recording.rate_hz,
        "unit": recording.unit,
        "repeat": recording.repeat,
        "simulated": bool(recording.simulated),
        "samples": recording.samples.size,
        "clipped_share": recording.clipped_share,
    }


def write_samples(path: Path, recording: Recording) -> None:
    """Write a recording's samples as one column of numbers, from which they load back equal."""
    header = f"acceleration_{recording.unit}\n"
    # A sensor has few steps, so each value, told apart by its bits, becomes text only once: repr,
    # the shortest exact one.
    bits = recording.samples.view(np.int64).tolist()
    values = dict(zip(bits, recording.samples.tolist(), strict=True))
    texts = {each: repr(value) for each, value in values.items()}
    lines = "\n".join([texts[each] for each in bits])
    path.write_text(header + lines + "\n", encoding="utf-8")


def _sidecar_row(path: Path) -> dict[str, str]:
    values = read_json_object(path.with_suffix(".json"), advice="rewrite it")
    given = {key: str(value) for key, value in values.items() if value is not None}
    return {**given, "file": path.name}


def stated(folder: Path, row: Mapping[str, str]) -> dict[str, Any]:
    """What a row of `listed` says; InputError, with table or sidecar, row and column, for a cell
    that cannot stand there."""
    return {**typed(row, KNOWN_COLUMNS, _place(folder, row)), "texture": row["texture"]}


def _place(folder: Path, row: Mapping[str, str]) -> str:
    index = folder / INDEX_NAME
    name = row["file"]
    if not index.is_file():
        return f"{Path(name).with_suffix('.json')}"
    return f"row {shortened(name)} of {index}"


def _load_row(folder: Path, row: Mapping[str, str]) -> Recording:
    stated_cells = stated(folder, row)
    path = listed_file(folder, row["file"], index_name=INDEX_NAME)
    unit, scale_g = stated_cells["unit"] or "arbitrary", stated_cells["g_per_fullscale"]
    if path.suffix.lower() == ".wav":
        samples, rate_hz = read_wav(path, channel=stated_cells["channel"])
        if scale_g is not None:
            samples, unit = samples * scale_g, "g"
    else:
        samples = _read_samples(path)
        if (rate_hz := stated_cells["rate_hz"]) is None:
            (column,) = chosen(INDEX_COLUMNS, "rate_hz")
            raise column.refusal("", _place(folder, row))
    try:
        recording = Recording(
            samples,
            rate_hz,
            stated_cells["speed_mm_s"],
            stated_cells["force_n"],
            stated_cells["texture"],
            unit=unit,
            simulated=stated_cells["simulated"] == "true",
            repeat=stated_cells["repeat"] or 1,
            clipped_share=nan
            if stated_cells["clipped_share"] is None
            else stated_cells["clipped_share"],
        )
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    expected = stated_cells["samples"]
    if expected is not None and samples.size != expected:
        raise InputError(
            f"expected {expected} samples in {path.name}, got {samples.size}; the file is "
            "truncated or was changed, copy or record it again."
        )
    return recording


def _read_samples(path: Path) -> Floats:
    """One column of numbers below a header; a last line without its end counts as truncated."""
    text = read_text(path, "a recording")
    lines = text.split("\n")
    if len(lines) < 2 or not text.strip():
        raise InputError(f"expected a header and samples in {path}, got an empty file; re-record.")
    if number_in(lines[0]) is not None:
        raise InputError(
            f"expected a header such as acceleration_g as the first line of {path}, got the number "
            f"{shortened(lines[0])}; add one, or the first sample would be lost."
        )
    if lines[-1] != "":
        raise InputError(
            f"expected {path} to end with a whole line, got {shown(lines[-1])} at its end: "
            "the file is truncated; copy or record it again."
        )
    try:
        return np.array(list(map(float, lines[1:-1])))
    except ValueError:
        other = next(line for line in lines[1:-1] if number_in(line) is None)
        raise InputError(
            f"expected one number per line in {path}, got {shown(other)}; import files of another "
            "layout with tactileq import csv."
        ) from None
