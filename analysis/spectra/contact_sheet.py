"""The spectra of a whole stimulus set, from its files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.files.folders import listed_file
from tactileq.modeling.files.stimulus_table import MANIFEST, STIMULUS_COLUMNS
from tactileq.modeling.files.tables import read_table
from tactileq.stimuli.sets.manifest import COMPENSATED
from tactileq.stimuli.sets.recipe import Recipe
from tactileq.stimuli.sets.rendering import steady_part
from tactileq.stimuli.sets.sources import RECIPE

LINE_HZ = 10.0
_NAMES = ("texture", "trajectory", "model")


@dataclass(frozen=True, eq=False)
class ContactSheet:
    """Spectra of T textures, R trajectories and M models; NaN where the set has no such file.

    Parameters
    ----------
    textures, trajectories, models : tuple of str
        In the manifest's order.
    frequency_hz : (n,) ndarray
        0 … half the highest rate among the models.
    density_db : (T, R, M, n) ndarray
        Power spectral density in dB re 1 g²/Hz (re 1/Hz in an arbitrary unit), mean over seeds.
    level_db : (T, R, M) ndarray
        RMS level in dB re 1 g, mean power over seeds.
    unit : str
        "g", or "arbitrary" where any model's is.
    simulated : (T,) ndarray of bool
        Whether anything of a texture was simulated.
    compensated : bool
        Whether spectra are those of a vibrator's drive; levels are always those at the hand.
    """

    name: str
    textures: tuple[str, ...]
    trajectories: tuple[str, ...]
    models: tuple[str, ...]
    frequency_hz: Floats
    density_db: Floats
    level_db: Floats
    unit: str
    simulated: Bools
    compensated: bool


def contact_sheet(folder: str | Path) -> ContactSheet:
    """Spectra of all stimuli of a set, from its WAV files (of the lowest rate, where several).

    By Welch's method over each file without its fades: Hann windows of 0.1 s, half overlapping, so
    that lines lie 10 Hz apart.

    Parameters
    ----------
    folder : path
        A set that `tactileq.stimuli.sets.writing.write_set` has written.
    """
    place = Path(folder)
    manifest = pd.DataFrame(read_table(place / MANIFEST, STIMULUS_COLUMNS))
    chosen = manifest[manifest["rate_hz"] == manifest["rate_hz"].min()]
    names = [tuple(dict.fromkeys(chosen[column])) for column in _NAMES]
    rate_hz = int(chosen["rate_hz"].iloc[0])
    frequency_hz = np.arange(rate_hz // LINE_HZ // 2 + 1) * LINE_HZ
    shown = frequency_hz <= chosen["model_rate_hz"].max() / 2
    shape = tuple(map(len, names))
    density = np.full((*shape, int(shown.sum())), np.nan)
    power = np.full(shape, np.nan)
    for of_one, files in chosen.groupby(list(_NAMES)):
        at = tuple(known.index(name) for known, name in zip(names, of_one, strict=True))
        listed = [listed_file(place, name, index_name=MANIFEST) for name in files["file"]]
        found = list(map(_density, listed, files["full_scale_g"]))
        density[at] = np.mean(found, axis=0)[shown]
        power[at] = np.mean(10 ** (files["level_db"] / 10))
    simulated = chosen.groupby("texture", sort=False)["simulated"].any()
    with np.errstate(divide="ignore"):
        density_db, level_db = 10 * np.log10(density), 10 * np.log10(power)
    textures, trajectories, models = names
    return ContactSheet(
        name=Recipe.load(place / RECIPE).name,
        textures=textures,
        trajectories=trajectories,
        models=models,
        frequency_hz=frequency_hz[shown],
        density_db=density_db,
        level_db=level_db,
        unit="g" if (chosen["unit"] == "g").all() else "arbitrary",
        simulated=simulated.to_numpy(dtype=bool),
        compensated=bool((chosen["vibrator"] == COMPENSATED).all()),
    )


def _density(path: Path, full_scale_g: float | None) -> Floats:
    """Power spectral density of one file in g²/Hz."""
    import soundfile  # late: loads a shared library that most uses never need
    from scipy.signal import welch

    samples, rate_hz = soundfile.read(path, dtype="float64")
    scale = 1.0 if pd.isna(full_scale_g) else full_scale_g
    steady = steady_part(samples * scale, rate_hz)
    line = round(rate_hz / LINE_HZ)
    _, density = welch(steady, rate_hz, nperseg=min(line, steady.size), nfft=line, detrend=False)
    return np.asarray(density, dtype=np.float64)
