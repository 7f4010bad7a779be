"""What compensating a vibrator gains, and how well its test must be recorded.

Simulated: second-order vibrators (mass, spring, damper; `stimuli.planted.vibrators`) are tested
with white noise, identified and compensated (docs/method/vibrators.md).

Example: python docs/studies/vibrator_study.py writes vibrator_study.png and two tables,
vibrator_study.tsv and vibrator_study_coherence.tsv, beside this file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from rich.progress import track

from analysis.figures.vibrator import figure_vibrator
from analysis.spectra.vibrator import CompensatedVibrator, compensated
from modeling import InputError, Vibrator, compensation_for, flat_band, identify_vibrator
from stimuli.planted.vibrators import SimulatedVibrator

RATE_HZ = 5000.0
DURATION_S = 120.0
SENSOR_NOISE = 0.2  # re the flat part's own RMS: a coherence of 0.96 there
RESONANCES_HZ = (40.0, 80.0, 200.0)
QUALITIES = (2.0, 5.0, 10.0, 20.0)
SHOWN = SimulatedVibrator(80.0, 5.0, RATE_HZ)
NOISES = (0.0, 0.2, 0.4, 0.5, 0.6, 0.65, 0.7, 1.0, 4.0)
SHORT_S = 20.0
REPEATS = 20


def tested(
    truth: SimulatedVibrator, *, duration_s: float, sensor_noise: float, seed: int
) -> Vibrator:
    """A vibrator as its simulated test with white noise identifies it."""
    rng = np.random.default_rng(seed)
    drive = rng.standard_normal(round(duration_s * truth.rate_hz))
    acceleration = truth.accelerate(drive, sensor_noise=sensor_noise, rng=rng)
    return identify_vibrator(drive, acceleration, rate_hz=truth.rate_hz, simulated=True)


def row_of(truth: SimulatedVibrator, shown: CompensatedVibrator) -> dict[str, object]:
    """One vibrator: what was found, the bands in which it is flat, and what mistuning leaves.

    Flat bands and `uneven_db` are of the true response, not of the measured one.
    """
    frequency = np.geomspace(10.0, 0.98 * RATE_HZ / 2, 4000)
    found = shown.vibrator
    before = np.abs(truth.response(frequency)) / found.flat_gain
    after = before * np.abs(shown.compensation.response(frequency))
    flat_before, flat_after = (flat_band(frequency, r, level=1.0) for r in (before, after))
    row: dict[str, object] = {
        "true_frequency_hz": truth.frequency_hz,
        "true_quality": truth.quality,
        "frequency_hz": found.frequency_hz,
        "bandwidth_hz": found.bandwidth_hz,
        "height": found.height,
        "flat_from_before_hz": flat_before[0],
        "flat_from_after_hz": flat_after[0],
        "flat_to_hz": flat_after[1],
        "highest_after_db": 20 * np.log10(after.max()),
    }
    for off, left_db in zip(shown.mistunings, shown.left_db, strict=True):
        row[f"left_{off:+.0%}_db"] = left_db
    return row


def compensation_table() -> pd.DataFrame:
    """One row for each simulated vibrator."""
    rows = []
    truths = [SimulatedVibrator(f, q, RATE_HZ) for f in RESONANCES_HZ for q in QUALITIES]
    for seed, truth in enumerate(track(truths, "Vibrators")):
        found = tested(truth, duration_s=DURATION_S, sensor_noise=SENSOR_NOISE, seed=seed)
        rows.append(row_of(truth, compensated(found)))
    return pd.DataFrame(rows)


def uneven_db(found: Vibrator) -> float:
    """Largest deviation (dB) of the shown vibrator's true product from 1, from its f to Nyquist.

    What rolls off below the resonance is no matter of the test.
    """
    frequency = np.geomspace(SHOWN.frequency_hz, 0.98 * RATE_HZ / 2, 2000)
    product = compensation_for(found).response(frequency) * SHOWN.response(frequency)
    return float(np.abs(20 * np.log10(np.abs(product))).max())


def coherence_row(sensor_noise: float) -> dict[str, object]:
    """Repeated tests of the shown vibrator: how many were refused, how good the others are."""
    found, refused = [], 0
    for seed in range(REPEATS):
        try:
            found.append(tested(SHOWN, duration_s=SHORT_S, sensor_noise=sensor_noise, seed=seed))
        except InputError:
            refused += 1
    heights = np.array([vibrator.height for vibrator in found])
    left_db = np.array([uneven_db(vibrator) for vibrator in found])
    return {
        "sensor_noise": sensor_noise,
        "true_coherence_flat": 1 / (1 + sensor_noise**2),
        "tests": REPEATS,
        "refused": refused,
        "median_coherence": np.mean([v.coherence for v in found]) if found else np.nan,
        "height": heights.mean() if found else np.nan,
        "height_sd": heights.std(ddof=1) if len(found) > 1 else np.nan,
        "uneven_db": left_db.max() if found else np.nan,
    }


def main() -> None:
    """Run the study and write its tables and its figure beside this file."""
    target = Path(__file__).with_suffix("")
    tables = {
        target.with_suffix(".tsv"): compensation_table(),
        target.with_name(f"{target.name}_coherence.tsv"): pd.DataFrame(
            [coherence_row(noise) for noise in track(NOISES, "Coherence")]
        ),
    }
    for path, table in tables.items():
        table.insert(0, "simulated", True)
        table.to_csv(path, sep="\t", index=False, float_format="%.4g")
        print(table.to_string(float_format="%.3g"))
    shown = compensated(tested(SHOWN, duration_s=DURATION_S, sensor_noise=SENSOR_NOISE, seed=0))
    figure_vibrator(shown).savefig(target.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
