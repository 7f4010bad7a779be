"""How `joint` performs on textures more difficult than sums of layers on white noise.

Simulated: random layers whose places are known (`tactileq.stimuli.planted.spectra`), over 2 × 2
conditions of one level each, with difficulties met in laboratories: coloured floors, mains hum, a
pure tone, many layers, short and long records, a turntable that slows down, a level that changes.

Example: python docs/studies/harder_truths_study.py writes harder_truths_study.tsv beside this file
and prints the table. `--textures 20 --out before.tsv` in a checkout of an earlier version gives the
figures of that one.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from tactileq.analysis.textures.recovery import match_layers
from tactileq.modeling import PEQ, Recording, RecordingSet, fit_texture
from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.threads import one_linear_algebra_thread
from tactileq.stimuli.planted.spectra import NOISE_GAIN, RATE_HZ, RandomTruth, random_truth

TEXTURES = 40
CONDITIONS = ((100.0, 1.0), (100.0, 2.0), (200.0, 1.0), (200.0, 2.0))
LEVELS = (1.0, 1.2, 1.4, 1.7)  # of the whole texture, in each condition
FREQUENCY_HZ = np.arange(15.0, 2400.0)
TONE_HZ, TONE_RMS_G = 333.3, 0.2
HUM_SHARE = 2.0  # of the texture's RMS
DRIFT = 0.2
MANY = (6, 10)


@dataclass(frozen=True)
class Case:
    """Records of one truth, changed; and the power that is expected of a model.

    Parameters
    ----------
    record : callable
        Truth, generator → (n,) samples.
    floor_slope : float
        Of a floor of its own, in powers of the frequency.
    layers : (int, int), optional
        Fewest and most of them, instead of one to five.
    tone : bool
        A pure tone counts as a layer.
    """

    record: Callable[[RandomTruth, np.random.Generator], Floats]
    floor_slope: float = 0.0
    layers: tuple[int, int] | None = None
    tone: bool = False
    level: float = 1.0  # of the mean power, relative to the truth's


def steady(seconds: float) -> Callable[[RandomTruth, np.random.Generator], Floats]:
    """Records of this length."""

    def record(truth: RandomTruth, rng: np.random.Generator) -> Floats:
        return truth.record(rng=rng, duration_s=seconds)

    return record


def with_floor(slope: float) -> Callable[[RandomTruth, np.random.Generator], Floats]:
    """A second of it on a floor of its own."""

    def record(truth: RandomTruth, rng: np.random.Generator) -> Floats:
        clean = truth.record(rng=rng)
        frequency = np.fft.rfftfreq(4 * clean.size, 1 / RATE_HZ)
        noise = np.fft.rfft(rng.standard_normal(4 * clean.size)) * floor(frequency, slope)
        return np.asarray(clean + np.fft.irfft(noise)[: clean.size])

    return record


def floor(frequency_hz: Floats, slope: float) -> Floats:
    """Magnitude of a coloured floor, that of the white one at 200 Hz; flat below 10 Hz."""
    return NOISE_GAIN * (np.maximum(frequency_hz, 10.0) / 200.0) ** (slope / 2)


def with_hum(truth: RandomTruth, rng: np.random.Generator) -> Floats:
    """50 Hz and a quarter as much at 150 Hz, together twice the texture's RMS."""
    clean = truth.record(rng=rng)
    turns = 2 * np.pi * 50.02 * np.arange(clean.size) / RATE_HZ
    phases = rng.uniform(0, 2 * np.pi, 2)
    hum = np.sin(turns + phases[0]) + 0.25 * np.sin(3 * turns + phases[1])
    return np.asarray(clean + HUM_SHARE * clean.std() / hum.std() * hum)


def with_tone(truth: RandomTruth, rng: np.random.Generator) -> Floats:
    """A pure tone between two lines of the spectrum."""
    clean = truth.record(rng=rng)
    turns = 2 * np.pi * (TONE_HZ * np.arange(clean.size) / RATE_HZ + rng.uniform())
    return np.asarray(clean + np.sqrt(2) * TONE_RMS_G * np.sin(turns))


def drifting(truth: RandomTruth, rng: np.random.Generator) -> Floats:
    """All frequencies rise by 20 % within the second."""
    n = round(RATE_HZ)
    wide = truth.record(rng=rng, duration_s=1.5)
    share = np.arange(n) / n
    at = (share + DRIFT * (share**2 - share) / 2) * n + n / 4
    return np.interp(at, np.arange(wide.size), wide)


def doubling(truth: RandomTruth, rng: np.random.Generator) -> Floats:
    """Twice the amplitude from the middle on."""
    clean = truth.record(rng=rng)
    return np.asarray(clean * np.where(np.arange(clean.size) < clean.size / 2, 1.0, 2.0))


CASES = {
    "white floor, 1 s": Case(steady(1.0)),
    "1/f floor": Case(with_floor(-1.0), floor_slope=-1.0),
    "1/f² floor": Case(with_floor(-2.0), floor_slope=-2.0),
    "hum of 50 and 150 Hz": Case(with_hum),
    "pure tone": Case(with_tone, tone=True),
    "6 to 10 layers": Case(steady(1.0), layers=MANY),
    "records of 0.25 s": Case(steady(0.25)),
    "records of 10 s": Case(steady(10.0)),
    "frequencies rise by 20 %": Case(drifting),
    "amplitude doubles": Case(doubling, level=np.sqrt(2.5)),
}


def truth_of(case: Case, rng: np.random.Generator) -> RandomTruth:
    """Coherent layers; many of them from several draws of few."""
    drawn = random_truth("coherent", rng=rng)
    if case.layers is not None:
        wanted = int(rng.integers(case.layers[0], case.layers[1] + 1))
        parts = [drawn.layers]
        while sum(part.gains.size for part in parts) < wanted:
            parts.append(random_truth("coherent", rng=rng).layers)
        names = ("frequencies_hz", "bandwidths_hz", "gains")
        f, b, g = (np.concatenate([getattr(p, name) for p in parts])[:wanted] for name in names)
        order = np.argsort(f)
        many = replace(
            drawn.layers, frequencies_hz=f[order], bandwidths_hz=b[order], gains=g[order]
        )
        drawn = RandomTruth(many, "coherent")
    if case.floor_slope:  # the floor of its own takes the place of the white one
        quiet = replace(drawn.layers, noise_gain=1e-3 * NOISE_GAIN)
        drawn = RandomTruth(quiet, "coherent")
    return drawn


def judged(case: Case, seed: int) -> list[dict[str, float]]:
    """One texture: what was found in each condition."""
    rng = np.random.default_rng([seed, list(CASES.values()).index(case)])
    truth = truth_of(case, rng)
    recordings = RecordingSet(
        Recording(level * case.record(truth, rng), RATE_HZ, *condition, "random", simulated=True)
        for condition, level in zip(CONDITIONS, LEVELS, strict=True)
    )
    model = fit_texture(recordings)
    true_hz, width_hz = truth.layers.frequencies_hz, truth.layers.bandwidths_hz
    power = truth.expected_power(FREQUENCY_HZ)
    if case.floor_slope:
        power = power + floor(FREQUENCY_HZ, case.floor_slope) ** 2
    power = power * case.level**2
    if case.tone:
        true_hz, width_hz = np.append(true_hz, TONE_HZ), np.append(width_hz, 1.0)
        # Over lines of 1 Hz of a response to unit noise at this rate.
        power[np.argmin(np.abs(FREQUENCY_HZ - TONE_HZ))] += TONE_RMS_G**2 * RATE_HZ / 2
    is_peak = own_peaks(model).is_peak
    rows = []
    for condition, level in zip(CONDITIONS, LEVELS, strict=True):
        found = model.peq(*condition)
        partner = match_layers(true_hz, width_hz, estimated_frequency_hz=found.frequencies_hz)
        peaks = match_layers(
            true_hz, width_hz, estimated_frequency_hz=found.frequencies_hz[is_peak]
        )
        response = fine_power(found)
        rows.append(
            {
                "true": true_hz.size,
                "found": found.gains.size,
                "matched": int((partner >= 0).sum()),
                "peaks": int(is_peak.sum()),
                "matched_peaks": int((peaks >= 0).sum()),
                "level_error_db": 10 * np.log10(response / (level**2 * power.sum())),
            }
        )
    return rows


def fine_power(peq: PEQ) -> float:
    """Power in the band per Hz, fine enough for a tone."""
    finer = np.arange(FREQUENCY_HZ[0] - 0.5, FREQUENCY_HZ[-1] + 0.5, 0.02) + 0.01
    return float(np.sum(peq.response(finer) ** 2) * 0.02)


def study(textures: int) -> pd.DataFrame:
    """Per case: precision, recall, and level errors over all conditions of all textures.

    Once of all layers, and once of those that are peaks of their own
    (docs/method/fitting.md#own-peaks).
    """
    rows = []
    for name, case in CASES.items():
        found = pd.DataFrame([row for seed in range(textures) for row in judged(case, seed)])
        level = found["level_error_db"]
        rows.append(
            {
                "case": name,
                "textures": textures,
                "precision": found["matched"].sum() / max(1, found["found"].sum()),
                "recall": found["matched"].sum() / found["true"].sum(),
                "precision_of_own_peaks": found["matched_peaks"].sum()
                / max(1, found["peaks"].sum()),
                "recall_of_own_peaks": found["matched_peaks"].sum() / found["true"].sum(),
                "layers_per_true_layer": found["found"].sum() / found["true"].sum(),
                "median_level_error_db": level.median(),
                "largest_level_error_db": level.iloc[int(level.abs().to_numpy().argmax())],
                "simulated": True,
            }
        )
        print(rows[-1], flush=True)
    return pd.DataFrame(rows)


def main() -> None:
    """Run the study and write its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--textures", type=int, default=TEXTURES)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".tsv"))
    asked = parser.parse_args()
    with one_linear_algebra_thread():
        table = study(asked.textures)
    table.to_csv(asked.out, sep="\t", index=False, float_format="%.4g")
    print(table.round(3).to_string(index=False))


if __name__ == "__main__":
    main()
