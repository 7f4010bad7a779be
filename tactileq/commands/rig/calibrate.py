"""tactileq rig calibrate: measured figures in place of assumed ones."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from tactileq.modeling.errors import counted
from tactileq.options import RigPath, Seed

if TYPE_CHECKING:
    from tactileq.rig.desk.calibration.measuring import Accelerometer
    from tactileq.rig.devices.sound.vibration import VibrationOutput
    from tactileq.rig.shared.setup.rig_file import RigFile

What = Literal["floor", "vibrator", "level", "pressure"]


def rig_calibrate(
    what: Annotated[
        What,
        typer.Argument(
            help="floor: the accelerometer's noise at rest; vibrator: its resonance; level: g per "
            "volt at the held pen; pressure: force curve of a pen tablet, by weights."
        ),
    ],
    rig: RigPath = Path("rig.toml"),
    level_g: Annotated[
        float | None,
        typer.Option("--level", help="RMS of the test noise, in g; by default half the limits."),
    ] = None,
    low_hz: Annotated[
        float, typer.Option("--low", help="Lower edge of the frequency band, Hz.")
    ] = 100.0,
    high_hz: Annotated[
        float, typer.Option("--high", help="Upper edge of the frequency band, Hz.")
    ] = 500.0,
    placements: Annotated[
        int, typer.Option(min=3, help="How often the pen is picked up again, for the level.")
    ] = 5,
    seed: Seed = 0,
) -> None:
    """Measure a figure of the rig, and write it into the rig file.

    Calibrate in this order: floor, vibrator, level; pressure at any time. A level that was measured
    before the vibrator no longer fits, and nothing plays until it is measured again. The command
    asks you for each step, refuses implausible results, and leaves the file unchanged if you stop
    it.

    Example: tactileq rig calibrate level --rig rig.toml
    """
    from tactileq.rig.shared.setup.rig_file import RigFile

    loaded = RigFile.load(rig)
    if what == "pressure":
        return _pressure(loaded)
    if what == "floor":
        return _floor(loaded)
    if what == "vibrator":
        return _vibrator(loaded, level_g, seed=seed)
    return _level(loaded, level_g, band_hz=(low_hz, high_hz), placements=placements, seed=seed)


def _floor(rig: RigFile) -> None:
    from tactileq.rig.desk.calibration.floor import SHORTEST_FLOOR_S, no_contact_floor
    from tactileq.rig.desk.calibration.measuring import Accelerometer
    from tactileq.rig.desk.calibration.opening import accelerometer_input
    from tactileq.rig.desk.calibration.steps import floor_figures

    with accelerometer_input(rig) as source:
        _ask("Put the pen down and touch nothing")
        record = Accelerometer(source).record(2 * SHORTEST_FLOOR_S)
    floor = no_contact_floor(record.samples_g, rate_hz=record.rate_hz)
    print(f"at rest {1e3 * floor.rms_g:.2f} mg RMS from 10 to 1000 Hz, peak {floor.peak_g:.4f} g")
    bands = zip(floor.band_hz[::3], floor.band_rms_g[::3], strict=True)
    print("in third octaves: " + ", ".join(f"{f:.0f} Hz {1e3 * g:.2f} mg" for f, g in bands))
    if floor.mains_hz is not None:
        lines = ", ".join(f"{hz:.0f}" for hz in floor.hum.frequency_hz)
        print(
            f"warning: mains hum ({lines} Hz), {1e3 * floor.hum_rms_g:.2f} mg RMS; ground the "
            "amplifier and keep the sensor's cable away from power cables."
        )
    _write(rig, floor_figures(rig, floor, today=date.today()))


def _vibrator(rig: RigFile, level_g: float | None, *, seed: int) -> None:
    from tactileq.rig.desk.calibration.signals import usual_rms_g
    from tactileq.rig.desk.calibration.steps import (
        IDENTIFICATION_BAND_HZ,
        check_softly,
        measure_vibrator,
        save_vibrator,
    )

    rms_g = usual_rms_g(rig.safe_limits) if level_g is None else level_g
    with _bench(rig) as (sound, accelerometer):
        _ask("Hold the pen as in the study, off any surface; noise plays for 12 s")
        check_softly(rig, sound, accelerometer, rms_g=rms_g, band_hz=IDENTIFICATION_BAND_HZ)
        found = measure_vibrator(rig, sound, accelerometer, rms_g=rms_g, seed=seed)
    print(
        f"resonance {found.frequency_hz:.1f} Hz, {found.bandwidth_hz:.1f} Hz wide, "
        f"{found.height:.2f} times the flat part of {found.flat_gain:.3g} g/V; coherence "
        f"{found.coherence:.2f}"
    )
    name = f"vibrator_{datetime.now():%Y%m%d_%H%M%S}.json"
    _write(rig, save_vibrator(rig, found, name))
    print(
        "note: now calibrate the level, which this result changes; one from before it no longer "
        "fits, and nothing plays with it."
    )


def _level(
    rig: RigFile,
    level_g: float | None,
    *,
    band_hz: tuple[float, float],
    placements: int,
    seed: int,
) -> None:
    from tactileq.rig.desk.calibration.level import level_of
    from tactileq.rig.desk.calibration.signals import usual_rms_g
    from tactileq.rig.desk.calibration.steps import check_softly, level_figures, measure_gain

    rms_g = usual_rms_g(rig.safe_limits) if level_g is None else level_g
    gains = []
    with _bench(rig) as (sound, accelerometer):
        for number in range(1, placements + 1):
            _ask(f"Placement {number} of {placements}: pick up the pen again, off any surface")
            if number == 1:
                check_softly(rig, sound, accelerometer, rms_g=rms_g, band_hz=band_hz)
            found = measure_gain(
                rig, sound, accelerometer, rms_g=rms_g, band_hz=band_hz, seed=seed + number
            )
            gains.append(found.gain)
            per_volt = found.gain * rig.vibrator.g_per_volt.value
            print(f"  {per_volt:.3f} g/V, coherence {found.coherence:.3f}")
    level = level_of(gains)
    old = rig.vibrator.g_per_volt.value
    print(
        f"{old * level.gain:.3f} g/V (95 %: {old * level.low:.3f} to {old * level.high:.3f}) from "
        f"{band_hz[0]:g} to {band_hz[1]:g} Hz; placements spread by {level.spread_db:.1f} dB"
    )
    _write(rig, level_figures(rig, level, band_hz=band_hz, today=date.today()))


def _pressure(rig: RigFile) -> None:
    from tactileq.rig.desk.calibration.opening import pressure_reader
    from tactileq.rig.desk.calibration.steps import (
        STANDARD_GRAVITY,
        mean_pressure,
        pressure_figures,
    )
    from tactileq.rig.devices.hand.pressure import FEWEST_WEIGHTS, fit_pressure
    from tactileq.rig.shared.live.memory import Live

    weights_n: list[float] = []
    shares: list[float] = []
    with Live.create() as live, pressure_reader(rig, live):
        while True:
            grams = _grams(enough=len(set(weights_n)) >= FEWEST_WEIGHTS)
            if grams == 0:
                break
            shares.append(mean_pressure(live))
            weights_n.append(grams * 1e-3 * STANDARD_GRAVITY)
            print(f"  {weights_n[-1]:.3f} N: {shares[-1]:.4f} of the pen's range")
    curve = fit_pressure(weights_n, shares)
    print(
        f"{counted(len(curve.points), 'weight')}, residual {curve.residual_n:.3f} N, between "
        f"weights within {curve.left_out_n:.3f} N"
    )
    _write(rig, pressure_figures(rig, curve, today=date.today()))


def _grams(*, enough: bool) -> float:
    """The weight now on the pen; 0 to end."""
    end = ", 0 to end" if enough else ""
    grams: float = typer.prompt(f"Weight on the pen in g, the pen's own included{end}", type=float)
    if grams < 0 or (grams == 0 and not enough):
        raise ValueError(
            f"expected a weight above 0 g, got {grams:g}; use at least three different weights."
        )
    return grams


@contextmanager
def _bench(rig: RigFile) -> Iterator[tuple[VibrationOutput, Accelerometer]]:
    """Sound and accelerometer, open, whether or not an earlier calibration still fits."""
    from dataclasses import replace

    from tactileq.rig.desk.calibration.measuring import Accelerometer
    from tactileq.rig.desk.calibration.opening import accelerometer_input, opened_sound
    from tactileq.rig.shared.live.memory import Live

    with (
        accelerometer_input(rig) as source,
        Live.create() as live,
        opened_sound(replace(rig, calibration=None), live) as sound,
    ):
        yield sound, Accelerometer(source)


def _ask(what: str) -> None:
    typer.prompt(f"{what}; Enter when ready", default="", show_default=False)


def _write(rig: RigFile, figures: dict[str, object]) -> None:
    from tactileq.rig.shared.setup.rig_file import RigFile

    RigFile.updated(rig.path, figures)
    print(f"{', '.join(figures)}: {rig.path}")
