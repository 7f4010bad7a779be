"""Signals that are played at a resting hand: tone bursts, files of a stimulus set.

docs/method/live.md#signals
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import chosen
from tactileq.modeling.files.places import matching
from tactileq.modeling.files.reading import read_bytes
from tactileq.modeling.files.stimulus_table import MANIFEST, STIMULUS_COLUMNS
from tactileq.modeling.files.tables import read_cells, typed
from tactileq.modeling.files.wav import read_wav
from tactileq.modeling.models.loading import load_model, made_from
from tactileq.rig.shared.interface import PreparedSignal, Stimulus

RAMP_S = 0.02
_SIGNAL = chosen(
    STIMULUS_COLUMNS,
    *("file", "unit", "format", "full_scale_g", "sha256", "vibrator_sha256", "simulated"),
)
_WHERE = ("trajectory", "speed_mm_s", "force_n", "gain_db")
_CONDITION = (*_WHERE, "vibrator_sha256")
OF_SURFACES = (*_SIGNAL, *chosen(STIMULUS_COLUMNS, "texture", "model", "model_sha256", *_WHERE))


def tone_burst(
    frequency_hz: float, amplitude_g: float, *, duration_s: float, rate_hz: float
) -> PreparedSignal:
    """A sinusoid with raised-cosine ramps of 20 ms (shorter bursts: of half their length).

    Parameters
    ----------
    frequency_hz : float
        Above 0, below half the rate.
    amplitude_g : float
        Of the sinusoid, ≥ 0; its RMS is 0.707 of it.
    duration_s : float
        Ramps included; at least two samples, at most 60.

    Raises
    ------
    InputError
        For values out of range.
    """
    if not 0 < frequency_hz < rate_hz / 2:
        raise InputError(
            f"expected a frequency between 0 and half the rate of {rate_hz:g} Hz, got "
            f"{frequency_hz}; choose another."
        )
    if not 0 <= amplitude_g < np.inf:
        raise InputError(f"expected an amplitude of 0 g or more, got {amplitude_g}; correct it.")
    if not 2 / rate_hz <= duration_s <= 60:
        raise InputError(f"expected a burst of up to 60 s, got {duration_s} s; choose another.")
    count = round(duration_s * rate_hz)
    samples = amplitude_g * np.sin(2 * np.pi * frequency_hz / rate_hz * np.arange(count))
    ramp = min(round(RAMP_S * rate_hz), count // 2)
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(ramp) / ramp)
    samples[:ramp] *= rise
    samples[count - ramp :] *= rise[::-1]
    return PreparedSignal(samples_g=samples, rate_hz=rate_hz, vibrator_sha256=None, simulated=False)


def stimulus(folder: Path, which: str) -> PreparedSignal:
    """A file of a stimulus set, whose bytes are those that its manifest states.

    Parameters
    ----------
    folder : path
        Of tactileq stimuli.
    which : str
        Name of the file, or its SHA-256 (at least eight of its digits).

    Raises
    ------
    InputError
        For no such file, one that has changed, or one without a calibrated unit.
    """
    rows = read_cells(folder / MANIFEST, _SIGNAL)
    fitting = [
        (where, row)
        for where, row in rows
        if row["file"] == which or (len(which) >= 8 and row["sha256"].startswith(which))
    ]
    if len(fitting) != 1:
        raise InputError(
            f"expected the name or SHA-256 of one file of the set {folder}, got {shown(which)}, "
            f"which fits {len(fitting)} of {len(rows)}; see its {MANIFEST}."
        )
    where, row = fitting[0]
    return _prepared(folder, row, where)


def stimuli_of_surfaces(
    folder: Path, *, label: str, textures: Sequence[str]
) -> dict[str, Stimulus]:
    """The files of a stimulus set that stand for the surfaces of a study, by texture.

    Parameters
    ----------
    folder : path
        Of tactileq stimuli.
    label : str
        Of the models in its recipe; where the recipe has one label only, any will do.
    textures : sequence of str
        Those that have no file are left out.

    Raises
    ------
    InputError
        If no file has this label, several stand for one texture, or one cannot be used (see
        `stimulus`).
    """
    rows = read_cells(folder / MANIFEST, OF_SURFACES)
    for where, row in rows:
        typed(row, chosen(OF_SURFACES, "texture", "model"), where)
    labels = sorted({row["model"] for _, row in rows})
    if label not in labels and len(labels) > 1:
        raise InputError(
            f"expected files of models labelled {shown(label)} in the stimulus set {folder}, got "
            f"{', '.join(labels)}; name the study's set of models after one of them."
        )
    wanted = label if len(labels) != 1 else labels[0]
    sources = _sources(folder)
    found: dict[str, Stimulus] = {}
    for texture in textures:
        fitting = [
            (where, row)
            for where, row in rows
            if (row["texture"], row["model"]) == (texture, wanted)
        ]
        if len(fitting) > 1:
            raise InputError(
                f"expected one file of {texture} in the stimulus set {folder}, got {len(fitting)} "
                f"({fitting[0][1]['file']} and {fitting[1][1]['file']} among them); make a set "
                "with one trajectory, one seed and one rate."
            )
        if fitting:
            where, row = fitting[0]
            found[texture] = _stimulus(folder, row, where, sources=sources)
    return found


def _stimulus(
    folder: Path, row: Mapping[str, str], where: str, *, sources: Mapping[str, Path]
) -> Stimulus:
    typed(row, OF_SURFACES, where)
    prepared = _prepared(folder, row, where)
    source = sources.get(row["model_sha256"])
    model = None if source is None else load_model(source)
    return Stimulus(
        **vars(prepared),
        texture=row["texture"],
        sha256=row["sha256"],
        model_sha256=row["model_sha256"] if model is None else model.sha256,
        made_from=frozenset() if model is None else made_from(model),
        condition=tuple(row[name] for name in _CONDITION),
    )


def _sources(folder: Path) -> dict[str, Path]:
    """The copies of models that a set keeps, by the SHA-256 of their file."""
    copies = matching(folder / "sources", "*.json")
    return {hashlib.sha256(read_bytes(path, "a model")).hexdigest(): path for path in copies}


def _prepared(folder: Path, row: Mapping[str, str], where: str) -> PreparedSignal:
    cells: dict[str, Any] = dict(typed(row, _SIGNAL, where))
    path = folder / row["file"]
    found = hashlib.sha256(read_bytes(path, "the stimulus")).hexdigest()
    if found != row["sha256"]:
        raise InputError(
            f"expected {path} with the SHA-256 {row['sha256'][:8]}… of its manifest, got "
            f"{found[:8]}…; make the set again."
        )
    if row["unit"] != "g":
        raise InputError(
            f"expected a stimulus in g, got {path} in the unit {shown(row['unit'])}; make the set "
            "from calibrated recordings."
        )
    samples, rate_hz = read_wav(path)
    if row["format"] == "pcm24":
        if (full_scale_g := cells["full_scale_g"]) is None:
            (column,) = chosen(_SIGNAL, "full_scale_g")
            raise column.refusal("", where)
        samples = samples * full_scale_g
    return PreparedSignal(
        samples_g=samples,
        rate_hz=rate_hz,
        vibrator_sha256=cells["vibrator_sha256"],
        simulated=row["simulated"] == "true",
    )
