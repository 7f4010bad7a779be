"""Stimulus sets: WAV files rendered from models, and the manifest that says what they are."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import wavfile

from modeling import InputError, Renderer, TextureModel
from modeling.files import check_replaceable, file_stem, replace_folder, write_table

SETTLING_S = 0.5
FADE_S = 0.01
LONGEST_S = 3600.0


@dataclass(frozen=True)
class Stimulus:
    """One rendered file: the manifest's row. Levels in dB re 1 g (or re 1 where arbitrary)."""

    file: str
    texture: str
    model: str
    layers: int
    speed_mm_s: float
    force_n: float
    rate_hz: float
    duration_s: float
    seed: int
    unit: str
    rms: float
    level_db: float
    peak: float
    sha256: str
    simulated: str


def render_stimulus(
    model: TextureModel,
    speed_mm_s: float,
    *,
    force_n: float,
    rate_hz: float,
    duration_s: float,
    seed: int,
) -> NDArray[np.float64]:
    """Steady vibration at one speed and force, faded in and out over 10 ms; (n,) in g.

    The first half second, while the filters settle, is left out.
    """
    settling, samples = round(SETTLING_S * rate_hz), round(duration_s * rate_hz)
    renderer = Renderer(model, rate_hz=rate_hz, seed=seed)
    vibration = renderer.render(speed_mm_s, force_n, samples=settling + samples)[settling:]
    fade = min(round(FADE_S * rate_hz), samples // 2)
    ramp = 0.5 - 0.5 * np.cos(np.pi * (np.arange(fade) + 0.5) / max(fade, 1))
    vibration[:fade] *= ramp
    vibration[samples - fade :] *= ramp[::-1]
    return vibration


def write_set(
    folder: str | Path,
    models: Sequence[tuple[str, TextureModel]],
    *,
    conditions: Sequence[tuple[float, float]],
    rate_hz: float,
    duration_s: float,
    seed: int,
    progress: Callable[[str], None] | None = None,
) -> tuple[Stimulus, ...]:
    """Render every model in every condition to a WAV file and write `manifest.tsv`.

    Files are 32-bit float WAV whose samples are g (or the model's arbitrary unit), so nothing is
    scaled or clipped. The same arguments give the same bytes.

    Parameters
    ----------
    folder : path
        Appears whole or not at all; replaced if it was a stimulus set, refused if it was not.
    models : sequence of (label, TextureModel)
        The label ("full", "simplified", …) goes into the manifest's column `model`.
    conditions : sequence of (speed_mm_s, force_n)
        Finite, at least 0.
    rate_hz, duration_s : float
        Rate a whole number and at least every model's; duration one sample to one hour.
    seed : int
    progress : callable, optional
        Called with the file's name after each file.

    Raises
    ------
    InputError
        For anything outside these ranges; then nothing is written.
    """
    target = Path(folder)
    _check_options(conditions, rate_hz, duration_s)
    check_replaceable(target, index_name="manifest.tsv", what="a stimulus set")
    manifest: list[Stimulus] = []
    with replace_folder(target) as fresh:
        for label, model in models:
            for speed, force in conditions:
                vibration = render_stimulus(
                    model, speed, force_n=force, rate_hz=rate_hz, duration_s=duration_s, seed=seed
                )
                name = file_stem(f"{model.texture}_{label}_{speed:g}mms_{force:g}N") + ".wav"
                if (fresh / name).exists():
                    raise InputError(
                        f"expected each texture, model and condition once, got {name} twice; "
                        "remove one or rename it."
                    )
                wavfile.write(fresh / name, round(rate_hz), vibration.astype(np.float32))
                manifest.append(
                    _row(fresh / name, model, label, (speed, force), rate_hz, seed, vibration)
                )
                if progress:
                    progress(name)
        columns = [f.name for f in fields(Stimulus)]
        rows = [[getattr(stimulus, c) for c in columns] for stimulus in manifest]
        write_table(fresh / "manifest.tsv", columns, rows)
    return tuple(manifest)


def _check_options(
    conditions: Sequence[tuple[float, float]], rate_hz: float, duration_s: float
) -> None:
    if not (np.isfinite(rate_hz) and rate_hz > 0 and float(rate_hz).is_integer()):
        raise InputError(f"expected a whole rate in Hz for WAV files, got {rate_hz}; round it.")
    if not (np.isfinite(duration_s) and round(duration_s * rate_hz) >= 1):
        raise InputError(f"expected a duration above 0 s, got {duration_s}; give a longer one.")
    if duration_s > LONGEST_S:
        raise InputError(
            f"expected a duration of at most {LONGEST_S:g} s, got {duration_s}; give a shorter one."
        )
    for condition in conditions:
        if not all(np.isfinite(value) and value >= 0 for value in condition):
            raise InputError(
                "expected speeds (mm/s) and forces (N) of at least 0, got "
                f"{condition[0]} mm/s at {condition[1]} N; correct them."
            )


def _row(
    path: Path,
    model: TextureModel,
    label: str,
    condition: tuple[float, float],
    rate_hz: float,
    seed: int,
    vibration: NDArray[np.float64],
) -> Stimulus:
    rms = float(np.sqrt(np.mean(vibration**2)))
    return Stimulus(
        file=path.name,
        texture=model.texture,
        model=label,
        layers=model.n_layers,
        speed_mm_s=condition[0],
        force_n=condition[1],
        rate_hz=rate_hz,
        duration_s=vibration.size / rate_hz,
        seed=seed,
        unit=model.unit,
        rms=rms,
        level_db=20 * float(np.log10(rms)) if rms > 0 else -np.inf,
        peak=float(np.abs(vibration).max()),
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        simulated=str(model.simulated).lower(),
    )
