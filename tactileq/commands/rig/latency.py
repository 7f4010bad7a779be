"""tactileq rig latency: from the hand to the vibration, end to end."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.modeling.errors import InputError, counted
from tactileq.options import RigPath, Seed
from tactileq.printing import share_of

if TYPE_CHECKING:
    from tactileq.rig.desk.calibration.latency import LatencySummary, Part
    from tactileq.rig.desk.calibration.trials import Watched
    from tactileq.rig.shared.setup.rig_file import RigFile


def rig_latency(
    rig: RigPath = Path("rig.toml"),
    trials: Annotated[int, typer.Option(min=50, max=1000, help="Number of trials.")] = 60,
    hand: Annotated[
        bool,
        typer.Option(
            "--hand", help="Use your own strokes instead of a scripted hand that starts suddenly."
        ),
    ] = False,
    level_g: Annotated[
        float | None,
        typer.Option("--level", help="RMS of the vibration, in g; by default half the limits."),
    ] = None,
    accept: Annotated[
        str | None,
        typer.Option("--accept", help="Reason to accept more than 40 ms; stored in the rig file."),
    ] = None,
    seed: Seed = 0,
) -> None:
    """Measure the latency from hand to vibration, and write it into the rig file.

    A scripted hand steps from rest to a stroke; its readings pass through the same process, filter,
    shared memory and audio callback as any hand's, and the accelerometer (or a cable from output to
    input) shows when the vibration begins. With --hand you stroke, and the vibration's level is
    compared with your speed. A 95th percentile above 40 ms is refused without --accept.

    Example: tactileq rig latency --rig rig.toml
    """
    from tactileq.rig.desk.calibration.latency import check_latency, parts_of, summary_of
    from tactileq.rig.desk.calibration.signals import usual_rms_g
    from tactileq.rig.desk.calibration.steps import latency_figures
    from tactileq.rig.shared.setup.rig_file import RigFile

    loaded = RigFile.load(rig)
    if loaded.renderer is not None:
        raise InputError(
            f"expected a rig whose sound card plays the texture, got [device] in {rig}, which "
            "renders it; measure from its encoders to the accelerometer with an oscilloscope, and "
            "write [latency] yourself."
        )
    rms_g = usual_rms_g(loaded.safe_limits) if level_g is None else level_g
    with TemporaryDirectory() as folder:
        seen, latencies, loop_s = _measured(
            loaded, Path(folder), trials=trials, hand=hand, rms_g=rms_g, seed=seed
        )
    summary = summary_of(latencies, seed=seed)
    parts = parts_of(seen.readings["time_s"], seen.blocks, rate_hz=loaded.sound.rate_hz)
    _show(summary, parts, loop_s=loop_s, stated_s=_stated_delays_s(loaded))
    check_latency(summary, accepted=accept)
    how = "strokes by hand" if hand else "a scripted hand that steps"
    figures = latency_figures(loaded, summary, how=how, accepted=accept, today=date.today())
    RigFile.updated(rig, figures)
    print(f"{', '.join(figures)}: {rig}")


def _measured(
    rig: RigFile, folder: Path, *, trials: int, hand: bool, rms_g: float, seed: int
) -> tuple[Watched, list[float | None], float]:
    """What was seen, each trial's latency, and the loop-back's."""
    from dataclasses import replace

    from tactileq.rig.desk.calibration.measuring import Accelerometer
    from tactileq.rig.desk.calibration.opening import accelerometer_input, opened_sound
    from tactileq.rig.desk.calibration.trials import (
        TRIAL_STROKE_S,
        loop_back_s,
        probe_texture,
        step_latencies_s,
        stroke_latencies_s,
        watched,
        write_steps,
    )
    from tactileq.rig.desk.parts import hand_settings
    from tactileq.rig.devices.hand.reader import HandReader
    from tactileq.rig.shared.live.memory import Live

    settings = hand_settings(rig)
    if not hand:
        seconds = write_steps(folder / "steps.tsv", trials, seed=seed)
        settings = replace(settings, kind="scripted", script=str(folder / "steps.tsv"))
    else:
        seconds = 1.5 * trials * TRIAL_STROKE_S
    with (
        accelerometer_input(rig) as source,
        Live.create() as live,
        opened_sound(rig, live) as sound,
    ):
        accelerometer = Accelerometer(source)
        loop_s = loop_back_s(sound, accelerometer, rate_hz=rig.sound.rate_hz, rms_g=rms_g)
        floor = accelerometer.record(0.5)
        if hand:
            print(f"Stroke back and forth, about 10 cm and once a second, for {seconds:.0f} s.")
        with HandReader(live, settings), share_of("Trials") as advance:
            sound.play(probe_texture(rms_g))
            seen = watched(live, accelerometer, seconds, tick=lambda share: advance(share, ""))
            sound.silence()
        if faults := sound.faults():
            raise ValueError(faults[0])
    if not hand:
        return seen, step_latencies_s(seen), loop_s
    from tactileq.rig.desk.calibration.latency import high_passed

    quiet = high_passed(floor.samples_g, rate_hz=floor.rate_hz)
    delay_s = rig.hand.filter_delay_s.value
    lags = stroke_latencies_s(seen, floor_g2=float((quiet**2).mean()))
    return seen, [None if lag is None else lag + delay_s for lag in lags], loop_s


def _stated_delays_s(rig: RigFile) -> dict[str, float]:
    from tactileq.modeling.rendering.plan import plan_for
    from tactileq.rig.desk.calibration.trials import MODEL_RATE_HZ

    plan = plan_for(MODEL_RATE_HZ, rate_hz=rig.sound.rate_hz)
    return {
        "filter of the hand": rig.hand.filter_delay_s.value,
        "interpolation to the card's rate": plan.delay_s,
    }


def _show(
    summary: LatencySummary, parts: list[Part], *, loop_s: float, stated_s: dict[str, float]
) -> None:
    from rich.console import Console
    from rich.table import Table

    from tactileq.rig.desk.calibration.latency import AIM_MS

    table = Table(box=None, pad_edge=False)
    table.add_column("ms")
    table.add_column("median", justify="right")
    table.add_column("95 % within", justify="right")
    for name, delay_s in stated_s.items():
        table.add_row(f"{name}, as stated", f"{1e3 * delay_s:.1f}", "")
    for part in parts:
        table.add_row(part.name, f"{part.median_ms:.1f}", f"{part.p95_ms:.1f}")
    table.add_row("output to record (loop-back)", f"{1e3 * loop_s:.1f}", "")
    table.add_row(
        "hand to vibration, in total", f"{summary.median_ms:.1f}", f"{summary.p95_ms:.1f}"
    )
    Console().print(table)
    low, high = summary.median_within_ms
    low95, high95 = summary.p95_within_ms
    missed = f", {summary.missed} without a vibration" if summary.missed else ""
    print(
        f"{counted(summary.trials, 'trial')}{missed}; 95 % confidence intervals: median "
        f"{low:.1f} to {high:.1f} ms, 95th percentile {low95:.1f} to {high95:.1f} ms. The "
        "loop-back is included."
    )
    if summary.p95_ms > AIM_MS:
        print(
            f"note: the target is {AIM_MS:g} ms; smaller blocks or a faster device reduce latency."
        )
