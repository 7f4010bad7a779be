"""Sets of recordings, in memory and as folders."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from itertools import islice
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np

from modeling.arrays import Floats
from modeling.errors import InputError, counted, shortened, shown
from modeling.files.documents import read_json_object
from modeling.files.folders import check_replaceable, listed_file, replace_folder
from modeling.files.reading import read_text
from modeling.files.tables import (
    check_columns,
    is_number,
    number,
    read_table,
    whole_number,
    write_table,
)
from modeling.files.wav import full_scale, read_wav
from modeling.recordings.recording import Recording, check_condition

INDEX_NAME = "recordings.tsv"
INDEX_COLUMNS = (
    "file",
    "texture",
    "speed_mm_s",
    "force_n",
    "rate_hz",
    "unit",
    "repeat",
    "simulated",
    "samples",
    "clipped_share",
)
# What the index says of WAV files beside that; empty for CSV files.
WAV_COLUMNS = ("g_per_fullscale", "channel")
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
                rows.append((name, *index_cells(recording)))
            write_table(fresh / INDEX_NAME, INDEX_COLUMNS, rows)

    @staticmethod
    def load(folder: str | Path, *, texture: str | None = None) -> RecordingSet:
        """Read a folder with `recordings.tsv` (CSV or WAV files), or WAV files with JSON sidecars.

        Parameters
        ----------
        folder : str or Path
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
    """As `RecordingSet.load`, but unusable records are left out, with a sentence for each.

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
        rows = read_table(folder / INDEX_NAME, ("file", "texture", "speed_mm_s", "force_n"))
        _check_index(rows, folder / INDEX_NAME)
    elif not (rows := [_sidecar_row(path) for path in _sidecar_files(folder)]):
        raise InputError(
            f"expected {INDEX_NAME} (or WAV files with JSON sidecars) in {folder}, got neither; "
            "import the files first (tactileq import wav|csv)."
        )
    return [{**row, "texture": row.get("texture") or folder.name} for row in rows]


def _check_index(rows: Sequence[Mapping[str, str]], index: Path) -> None:
    """Refuse a column that is nearly one of ours, and a file that stands for two recordings.

    Columns of somebody's own are let be.
    """
    columns = rows[0] if rows else ()
    near = [name for name in columns if get_close_matches(name, KNOWN_COLUMNS, cutoff=0.7)]
    check_columns(near, KNOWN_COLUMNS, index)
    files = [(row["file"], row.get("channel", "")) for row in rows]
    for place, (name, channel) in enumerate(files):
        if (name, channel) in files[:place]:
            raise InputError(
                f"expected each file once in {index}, got {shown(name)} twice; remove the wrong "
                "row."
            )


def _sidecar_files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.glob("*.wav") if p.with_suffix(".json").is_file())


def index_cells(recording: Recording) -> tuple[str, ...]:
    """What the index says of a recording, in the order of `INDEX_COLUMNS` after `file`."""
    return (
        recording.texture,
        repr(recording.speed_mm_s),
        repr(recording.force_n),
        repr(recording.rate_hz),
        recording.unit,
        str(recording.repeat),
        str(recording.simulated).lower(),
        str(recording.samples.size),
        repr(recording.clipped_share),
    )


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


def _load_row(folder: Path, row: dict[str, str]) -> Recording:
    path = listed_file(folder, row["file"], index_name=INDEX_NAME)
    condition = _declared_condition(folder, row)
    unit = row.get("unit") or "arbitrary"
    if path.suffix.lower() == ".wav":
        channel = row.get("channel")
        samples, rate_hz = read_wav(
            path, channel=whole_number(channel, f"channel of {path.name}") if channel else None
        )
        if row.get("g_per_fullscale"):
            scale_g = number(row["g_per_fullscale"], f"g_per_fullscale of {path.name}")
            samples = samples * full_scale(scale_g, path.name)
            unit = "g"
    else:
        samples = _read_samples(path)
        rate_hz = number(row.get("rate_hz", ""), f"rate_hz of {path.name}")
    try:
        recording = Recording(
            samples,
            rate_hz,
            *condition,
            row["texture"],
            unit=unit,
            simulated=_flag(row.get("simulated") or "false", f"simulated of {path.name}"),
            repeat=whole_number(row.get("repeat") or "1", f"repeat of {path.name}"),
            clipped_share=number(
                row.get("clipped_share") or "nan", f"clipped_share of {path.name}"
            ),
        )
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    expected = row.get("samples")
    if expected and samples.size != number(expected, f"samples of {path.name}"):
        raise InputError(
            f"expected {shortened(expected)} samples in {path.name}, got {samples.size}; the file "
            "is truncated or was changed, copy or record it again."
        )
    return recording


def _declared_condition(folder: Path, row: Mapping[str, str]) -> tuple[float, float]:
    """Speed and force of a row; errors name the table, or the sidecar, the row and the column."""
    name = row["file"]
    index = folder / INDEX_NAME
    where = f"row {name} of {index}" if index.is_file() else f"{Path(name).with_suffix('.json')}"
    try:
        speed = number(row.get("speed_mm_s", ""), f"speed_mm_s of {name}")
        force = number(row.get("force_n", ""), f"force_n of {name}")
        check_condition(speed, force)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return speed, force


def _flag(text: str, name: str) -> bool:
    # A typing error must not turn simulated data into measured ones.
    if text.lower() not in ("true", "false"):
        raise InputError(f"expected true or false for {name}, got {shown(text)}; correct it.")
    return text.lower() == "true"


def _read_samples(path: Path) -> Floats:
    """One column of numbers below a header; a last line without its end counts as truncated."""
    text = read_text(path, "a recording")
    lines = text.split("\n")
    if len(lines) < 2 or not text.strip():
        raise InputError(f"expected a header and samples in {path}, got an empty file; re-record.")
    if is_number(lines[0]):
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
        other = next(line for line in lines[1:-1] if not is_number(line))
        raise InputError(
            f"expected one number per line in {path}, got {shown(other)}; import files of another "
            "layout with tactileq import csv."
        ) from None
