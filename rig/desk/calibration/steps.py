"""The measurements of a calibration: each plays, records, and reports its result.

Each figure says how it was measured; on a simulated rig it says so, too.
"""

from __future__ import annotations

import datetime
import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tactileq.modeling.errors import InputError, counted
from tactileq.modeling.files.writing import write_text
from tactileq.modeling.vibrators.identification import identify_vibrator
from tactileq.modeling.vibrators.vibrator import Vibrator
from tactileq.rig.desk.calibration.alignment import Aligned, aligned
from tactileq.rig.desk.calibration.floor import Floor
from tactileq.rig.desk.calibration.latency import LatencySummary
from tactileq.rig.desk.calibration.level import BandGain, MeasuredLevel, band_gain, check_unclipped
from tactileq.rig.desk.calibration.measuring import LOST, Accelerometer, PlaysSignals
from tactileq.rig.desk.calibration.signals import noise_signal
from tactileq.rig.devices.hand.pressure import PressureCurve
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.figures import Curve, Figure
from tactileq.rig.shared.setup.rig_file import RigFile

BAND_HZ = (100.0, 500.0)
IDENTIFICATION_BAND_HZ = (10.0, 2500.0)  # what a model holds; 10 Hz is their high-pass
LEVEL_S, IDENTIFICATION_S, SOFT_S = 2.0, 10.0, 1.0
SOFT_SHARE = 0.1
ATTEMPTS = 3
STANDARD_GRAVITY = 9.80665
PRESSURE_S = 2.0
LEAST_READINGS = 100


def check_softly(
    rig: RigFile,
    sound: PlaysSignals,
    accelerometer: Accelerometer,
    *,
    rms_g: float,
    band_hz: tuple[float, float],
) -> None:
    """Play a tenth of the level first: an uncalibrated rig may be many times too loud.

    Raises
    ------
    InputError
        If the whole level would be beyond the peak that the limits allow.
    """
    soft = _played(
        rig, sound, accelerometer, rms_g=SOFT_SHARE * rms_g, seconds=SOFT_S, band_hz=band_hz, seed=1
    )
    expected_g = float(np.abs(soft.recorded).max()) / SOFT_SHARE
    if expected_g > rig.limits.peak_g.value:
        raise InputError(
            f"expected at most {rig.limits.peak_g.value:g} g at the pen, got a tenth of the level "
            f"that says {expected_g:.1f} g for all of it; lower --level, or correct "
            "vibrator.g_per_volt."
        )


def measure_gain(
    rig: RigFile,
    sound: PlaysSignals,
    accelerometer: Accelerometer,
    *,
    rms_g: float,
    band_hz: tuple[float, float] = BAND_HZ,
    seed: int = 0,
) -> BandGain:
    """Acceleration per g that was asked for, at the pen as it is held now.

    Raises
    ------
    InputError
        For a level beyond the limits, clipping, poor coherence, or an accelerometer that hears
        nothing.
    """
    pair = _played(
        rig, sound, accelerometer, rms_g=rms_g, seconds=LEVEL_S, band_hz=band_hz, seed=seed
    )
    return band_gain(pair.played, pair.recorded, rate_hz=pair.rate_hz, band_hz=_inner(band_hz))


def measure_vibrator(
    rig: RigFile, sound: PlaysSignals, accelerometer: Accelerometer, *, rms_g: float, seed: int = 0
) -> Vibrator:
    """The vibrator's resonance, acceleration (g) per volt; InputError as `measure_gain`."""
    pair = _played(
        rig,
        sound,
        accelerometer,
        rms_g=rms_g,
        seconds=IDENTIFICATION_S,
        band_hz=IDENTIFICATION_BAND_HZ,
        seed=seed,
        raw=True,
    )
    check_unclipped(pair.recorded)
    volts = pair.played * rig.fullscale_per_g * rig.output_v.value
    return identify_vibrator(volts, pair.recorded, rate_hz=pair.rate_hz, simulated=rig.simulated)


def mean_pressure(live: Live, *, seconds: float = PRESSURE_S) -> float:
    """The mean of the pen's pressure over some time from now on, as a share of its range.

    Raises
    ------
    InputError
        If nothing presses.
    """
    count, _ = live.readings_since(live.readings_written)
    time.sleep(seconds)
    _, rows = live.readings_since(count)
    pressing = rows["force_n"][rows["force_n"] > 0]
    if pressing.size < min(LEAST_READINGS, rows.size or 1):
        raise InputError(
            f"expected a pen that is pressed for {seconds:g} s, got {pressing.size} readings; "
            "stand it upright under the weight, and read again."
        )
    return float(pressing.mean())


# --- What goes into the rig file ------------------------------------------------------------------


def level_figures(
    rig: RigFile, level: MeasuredLevel, *, band_hz: tuple[float, float], today: datetime.date
) -> dict[str, object]:
    """The calibration at the held pen, from acceleration per g asked for."""
    old = rig.vibrator.g_per_volt.value
    within_db = 10 * np.log10(level.high / level.low)
    source = (
        f"accelerometer at the held pen, {today.isoformat()}: noise from {band_hz[0]:g} to "
        f"{band_hz[1]:g} Hz, {level.placements} placements, spread {level.spread_db:.1f} dB, mean "
        f"within {within_db:.1f} dB (95 %){_note(rig)}"
    )
    found = Figure(old * level.gain, "g/V", False, source)
    basis = replace(rig, vibrator=replace(rig.vibrator, g_per_volt=found)).level_basis
    return {
        "vibrator.g_per_volt": found,
        "vibrator.measured_on": today,
        "calibration.date": today,
        "calibration.rig": rig.rig.name,
        "calibration.serials": list(rig.rig.serials),
        "calibration.rests_on": _lines(basis),
    }


def floor_figures(rig: RigFile, floor: Floor, *, today: datetime.date) -> dict[str, object]:
    """The accelerometer's floor."""
    hum = "no hum" if floor.mains_hz is None else f"{floor.mains_hz:g} Hz hum"
    source = f"at rest, {today.isoformat()}: RMS from 10 to 1000 Hz, {hum}{_note(rig)}"
    return {"accelerometer.noise_floor_g": Figure(floor.rms_g, "g", False, source)}


def pressure_figures(
    rig: RigFile, curve: PressureCurve, *, today: datetime.date
) -> dict[str, object]:
    """The pen's force over pressure."""
    source = (
        f"weights laid on, {today.isoformat()}: {counted(len(curve.points), 'weight')}, residual "
        f"{curve.residual_n:.3f} N{_note(rig)}"
    )
    return {"hand.pressure_curve": Curve(curve.points, "N", False, source)}


def latency_figures(
    rig: RigFile, summary: LatencySummary, *, how: str, accepted: str | None, today: datetime.date
) -> dict[str, object]:
    """What was measured from hand to vibration; `accepted` says why more than 40 ms may be."""
    source = f"{how}, {today.isoformat()}: {counted(summary.trials, 'trial')}{_note(rig)}"
    if accepted:
        source += f"; accepted: {accepted}"
    return {
        "latency.median_ms": Figure(summary.median_ms, "ms", False, source),
        "latency.p95_ms": Figure(summary.p95_ms, "ms", False, source),
        "latency.measured_on": today,
        "latency.rests_on": _lines(rig.latency_basis),
    }


def save_vibrator(rig: RigFile, vibrator: Vibrator, name: str) -> dict[str, object]:
    """Write what was identified beside the rig file; gives what names it there.

    An older calibration then says of which vibrator it is.
    """
    write_text(rig.path.parent / name, vibrator.to_json())
    named: dict[str, object] = {"vibrator.file": name}
    if rig.calibration is not None and rig.calibration.rests_on is None:
        named["calibration.rests_on"] = [f"vibrator.file = {rig.level_basis['vibrator.file']}"]
    return named


def _lines(basis: Mapping[str, str]) -> list[str]:
    return [f"{name} = {value}" for name, value in basis.items()]


def _note(rig: RigFile) -> str:
    return ", simulated" if rig.simulated else ""


# --- Playing --------------------------------------------------------------------------------------


def _inner(band_hz: tuple[float, float]) -> tuple[float, float]:
    """A band without the lines at its edges, which windows smear."""
    margin = 0.02 * (band_hz[1] - band_hz[0])
    return band_hz[0] + margin, band_hz[1] - margin


def _played(
    rig: RigFile,
    sound: PlaysSignals,
    accelerometer: Accelerometer,
    *,
    rms_g: float,
    seconds: float,
    band_hz: tuple[float, float],
    seed: int,
    raw: bool = False,
) -> Aligned:
    """Noise in a band, as asked for and as recorded; played again where samples were lost."""
    rate_hz = rig.output_rate_hz
    asked = noise_signal(seconds, rate_hz=rate_hz, rms_g=rms_g, band_hz=band_hz, seed=seed)
    for attempt in range(ATTEMPTS):
        try:
            record, _ = accelerometer.record_played(sound, asked, raw=raw)
            break
        except InputError as error:
            if LOST not in str(error) or attempt == ATTEMPTS - 1:
                raise
    return aligned(asked, record.samples_g, played_rate_hz=rate_hz, rate_hz=record.rate_hz)
