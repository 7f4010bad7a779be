"""Recordings: what an accelerometer on a tool measured in one condition, and sets of them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modeling.errors import InputError, check_texture_name
from modeling.files import (
    check_replaceable,
    is_number,
    number,
    read_table,
    replace_folder,
    whole_number,
    write_table,
)
from modeling.wav import full_scale, read_wav

UNITS = ("g", "arbitrary")
MIN_SAMPLES = 64
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


@dataclass(frozen=True, eq=False)
class Recording:
    """One record of tool vibration at one speed and one force.

    Parameters
    ----------
    samples : (n,) array_like
        Acceleration in `unit`; n ≥ 64, finite, not constant.
    rate_hz : float
        Sampling rate, > 0.
    speed_mm_s, force_n : float
        Tangential speed (mm/s) and normal force (N), ≥ 0. A force of 0 marks a no-contact
        recording, which gives the sensor's floor (METHOD 2).
    texture : str
        Name of the surface.
    unit : {"g", "arbitrary"}
        `arbitrary` where the g per full scale is unknown; such records are never compared with
        a detection threshold.
    simulated : bool
        True where no real surface was touched.
    repeat : int
        1 for the first record of a condition, 2 for the second, …
    clipped_share : float
        Share (0–1) of the samples in which the sensor was at its limit; left out (NaN), it is
        counted in `samples`. Give it where they are no longer the sensor's own (DFT321).

    Raises
    ------
    InputError
        For anything outside these ranges.
    """

    samples: NDArray[np.float64]
    rate_hz: float
    speed_mm_s: float
    force_n: float
    texture: str
    unit: str = "g"
    simulated: bool = False
    repeat: int = 1
    clipped_share: float = np.nan

    def __post_init__(self) -> None:
        check_texture_name(self.texture)
        where = f"recording of {self.texture!r}"
        object.__setattr__(self, "samples", _checked_samples(self.samples, where))
        for name in ("rate_hz", "speed_mm_s", "force_n"):
            object.__setattr__(self, name, float(getattr(self, name)))
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0):
            raise InputError(
                f"{where}: expected a sampling rate above 0 Hz, got {self.rate_hz}; give the rate."
            )
        for name, unit in (("speed_mm_s", "mm/s"), ("force_n", "N")):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(
                    f"{where}: expected {name} of at least 0 {unit}, got {value}; correct it."
                )
        if self.unit not in UNITS:
            raise InputError(
                f"{where}: expected a unit among {', '.join(UNITS)}, got {self.unit!r}; "
                "convert the data to g or call them arbitrary."
            )
        if self.repeat < 1:
            raise InputError(
                f"{where}: expected a repeat of at least 1, got {self.repeat}; fix it."
            )
        if np.isnan(self.clipped_share):
            object.__setattr__(self, "clipped_share", float(clipped_samples(self.samples).mean()))
        if not 0 <= self.clipped_share <= 1:
            raise InputError(
                f"{where}: expected a clipped_share of 0 to 1, got {self.clipped_share}; fix it."
            )

    @property
    def duration_s(self) -> float:
        """Length of the record in seconds."""
        return self.samples.size / self.rate_hz

    @property
    def condition(self) -> tuple[float, float]:
        """(speed in mm/s, force in N)."""
        return self.speed_mm_s, self.force_n

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Recording):
            return NotImplemented
        return self._labels() == other._labels() and np.array_equal(self.samples, other.samples)

    __hash__ = None  # type: ignore[assignment]

    def _labels(self) -> tuple[Any, ...]:
        return (
            self.rate_hz,
            *self.condition,
            self.texture,
            self.unit,
            self.simulated,
            self.repeat,
            self.clipped_share,
        )

    def describe(self) -> str:
        """One phrase that names the record, for messages."""
        repeat = f", repeat {self.repeat}" if self.repeat != 1 else ""
        return f"{self.texture} at {self.speed_mm_s:g} mm/s, {self.force_n:g} N{repeat}"


def _checked_samples(samples: ArrayLike, where: str) -> NDArray[np.float64]:
    array = np.array(samples, dtype=np.float64)
    if array.ndim != 1:
        raise InputError(
            f"{where}: expected one axis of samples, got an array of shape {array.shape}; "
            "choose an axis or combine them with DFT321."
        )
    if array.size < MIN_SAMPLES:
        raise InputError(
            f"{where}: expected at least {MIN_SAMPLES} samples, got {array.size}; record again."
        )
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise InputError(
            f"{where}: expected finite samples, got {bad.size} NaN or infinite ones, the first "
            f"at sample {bad[0]}; repair or record again."
        )
    if np.ptp(array) == 0:
        raise InputError(
            f"{where}: expected a vibration, got the constant value {array[0]:g}; "
            "check the sensor and its cable."
        )
    array.setflags(write=False)
    return array


def clipped_samples(samples: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which samples of one sensor axis are stuck at the highest or lowest value.

    An end counts, then with all its samples, where they pile up: more than twice as many as at
    the next three levels inwards together. A quantised sinusoid's highest level holds as many as
    those three, noise has fewer the further out. A level of more than half the samples is rest.

    Parameters
    ----------
    samples : (n,) ndarray
        Finite, as the sensor gave them: before any filter or combination.

    Returns
    -------
    (n,) ndarray of bool
    """
    # Rounded, so that rounding errors do not split one level into many.
    rounded = np.round(samples / (np.abs(samples).max() or 1.0), 9)
    levels, counts = np.unique(rounded, return_counts=True)
    stuck = np.zeros(samples.size, dtype=np.bool_)
    for end, inwards in ((0, counts[1:4]), (-1, counts[-4:-1])):
        if 2 * inwards.sum() < counts[end] <= samples.size / 2:
            stuck |= rounded == levels[end]
    return stuck


class RecordingSet:
    """The recordings of one or more textures; at most one per texture, condition and repeat.

    Parameters
    ----------
    recordings : iterable of Recording
        At least one.

    Raises
    ------
    InputError
        If there is none, or if two stand for the same condition.
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

    def __len__(self) -> int:
        return len(self.recordings)

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.recordings)

    def __repr__(self) -> str:
        return f"<RecordingSet of {len(self)} recordings of {', '.join(self.textures)}>"

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
        check_replaceable(target, index_name=INDEX_NAME, what="a recording set")
        with replace_folder(target) as fresh:
            rows = []
            for number, recording in enumerate(self.recordings, start=1):
                name = f"{number:04d}.csv"
                _write_samples(fresh / name, recording)
                rows.append((name, *_index_cells(recording)))
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
        rows = _listed(Path(folder))
        return RecordingSet(
            _load_row(Path(folder), row) for row in rows if texture in (None, row["texture"])
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
    for row in _listed(Path(folder)):
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
    return tuple(dict.fromkeys(row["texture"] for row in _listed(Path(folder))))


def _listed(folder: Path) -> list[dict[str, str]]:
    """One row of text per recording of a folder, each with its texture (else the folder's name)."""
    if not folder.is_dir():
        raise InputError(
            f"expected a folder of recordings, got {folder}; give a folder that holds {INDEX_NAME}."
        )
    if (folder / INDEX_NAME).is_file():
        rows = read_table(folder / INDEX_NAME, ("file", "texture", "speed_mm_s", "force_n"))
    elif not (rows := [_sidecar_row(path) for path in _sidecar_files(folder)]):
        raise InputError(
            f"expected {INDEX_NAME} (or WAV files with JSON sidecars) in {folder}, got neither; "
            "import the files first (tactileq import wav|csv)."
        )
    return [{**row, "texture": row.get("texture") or folder.name} for row in rows]


def _sidecar_files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.glob("*.wav") if p.with_suffix(".json").is_file())


def _index_cells(recording: Recording) -> tuple[str, ...]:
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


def _write_samples(path: Path, recording: Recording) -> None:
    # repr of a float is its shortest exact text: the file loads back equal.
    header = f"acceleration_{recording.unit}\n"
    lines = "\n".join(map(repr, recording.samples.tolist()))
    path.write_text(header + lines + "\n", encoding="utf-8")


def _sidecar_row(path: Path) -> dict[str, str]:
    sidecar = path.with_suffix(".json")
    try:
        values = json.loads(sidecar.read_text(encoding="utf-8"))
        assert isinstance(values, dict)
    except (ValueError, AssertionError):
        raise InputError(
            f"expected a JSON object in {sidecar}, got something else; rewrite it."
        ) from None
    given = {key: str(value) for key, value in values.items() if value is not None}
    return {**given, "file": path.name}


def _load_row(folder: Path, row: dict[str, str]) -> Recording:
    path = folder / row["file"]
    if not path.is_file():
        raise InputError(f"expected the file {path}, got nothing there; restore or unlist it.")
    unit = row.get("unit", "arbitrary")
    if path.suffix.lower() == ".wav":
        samples, rate_hz = read_wav(path)
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
            number(row.get("speed_mm_s", ""), f"speed_mm_s of {path.name}"),
            number(row.get("force_n", ""), f"force_n of {path.name}"),
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
            f"expected {expected} samples in {path.name}, got {samples.size}; the file is "
            "truncated or was changed, copy or record it again."
        )
    return recording


def _flag(text: str, name: str) -> bool:
    # A typing error must not turn simulated data into measured ones.
    if text.lower() not in ("true", "false"):
        raise InputError(f"expected true or false for {name}, got {text!r}; correct it.")
    return text.lower() == "true"


def _read_samples(path: Path) -> NDArray[np.float64]:
    """One column of numbers below a header; a last line without its end counts as truncated."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(
            f"expected one number per line in {path}, got other bytes; import files of another "
            "layout with tactileq import csv."
        ) from None
    lines = text.split("\n")
    if len(lines) < 2 or not text.strip():
        raise InputError(f"expected a header and samples in {path}, got an empty file; re-record.")
    if is_number(lines[0]):
        raise InputError(
            f"expected a header such as acceleration_g as the first line of {path}, got the number "
            f"{lines[0]}; add one, or the first sample would be lost."
        )
    if lines[-1] != "":
        raise InputError(
            f"expected {path} to end with a whole line, got {lines[-1]!r} at its end: "
            "the file is truncated; copy or record it again."
        )
    try:
        return np.array(list(map(float, lines[1:-1])))
    except ValueError as error:
        raise InputError(
            f"expected one number per line in {path}, got a line that is none ({error}); "
            "import files of another layout with tactileq import csv."
        ) from None
