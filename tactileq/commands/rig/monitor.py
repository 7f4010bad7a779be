"""tactileq rig monitor: a running rig, live in the terminal."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.interruption import Interrupted
from tactileq.modeling.errors import InputError
from tactileq.options import RigPath

if TYPE_CHECKING:
    from rich.table import Table

    from tactileq.modeling.models.loading import AnyModel
    from tactileq.modeling.rendering.plan import RenderCounters
    from tactileq.rig.devices.monitoring.bare_thread import WakeUps
    from tactileq.rig.devices.monitoring.figures import Range, Snapshot
    from tactileq.rig.devices.sound.vibration import VibrationOutput
    from tactileq.rig.shared.setup.rig_file import RigFile

_EVERY_S = 0.1


def rig_monitor(
    model: Annotated[
        Path | None,
        typer.Argument(metavar="[MODEL]", help="Model to play under the hand; by default silence."),
    ] = None,
    rig: RigPath = Path("rig.toml"),
    seconds: Annotated[
        float | None, typer.Option("--seconds", min=0.1, help="Stop after this time, s.")
    ] = None,
) -> None:
    """Show a rig live: hand, level, limits, missed blocks, latency, duration of the callback.

    For comparison it counts the misses of a bare thread that only wakes up once per block; these
    are due to the machine, not the rig. Ctrl-C ends it with a one-line summary. If the sound
    process is lost, another one continues; if that is impossible, an error says so and the exit
    code is 1.

    Example: tactileq rig monitor models/canvas.json --rig rig.toml
    """
    from tactileq.modeling.models.loading import load_model
    from tactileq.rig.shared.setup.rig_file import RigFile

    loaded = RigFile.load(rig)
    _watch(loaded, None if model is None else load_model(model), seconds)


def _watch(rig: RigFile, model: AnyModel | None, seconds: float | None) -> None:
    """Open the rig and show it until it is ended; the last line sums up."""
    from rich.live import Live as Screen

    from tactileq.rig.desk.calibration.opening import opened_sound
    from tactileq.rig.desk.parts import hand_reader
    from tactileq.rig.devices.monitoring.bare_thread import Look, WakeUps
    from tactileq.rig.devices.monitoring.figures import Monitor
    from tactileq.rig.shared.live.child import Child
    from tactileq.rig.shared.live.memory import Live
    from tactileq.rig.shared.live.messages import Done

    rate_hz, period_s = rig.output_rate_hz, rig.output_block_s
    with (
        Live.create() as live,
        hand_reader(rig, live) as hand,
        opened_sound(rig, live, hand=hand) as sound,
    ):
        bare = Child("tactileq.rig.devices.monitoring.bare_thread", period_s)
        bare.ready(Done)
        if model is not None:
            sound.play(model)
        faults: list[str] = []
        # Everything is counted from here on, not since its process began.
        start = now = time.monotonic()
        before = bare.ask(Look(), WakeUps)
        monitor = Monitor(live, rate_hz=rate_hz, peak_g=rig.limits.peak_g.value, grid=_grid(model))
        snapshot, missed = monitor.look(), WakeUps(0, 0)
        try:
            with Screen(auto_refresh=False, transient=True) as screen:
                while seconds is None or now - start < seconds:
                    time.sleep(_EVERY_S)
                    faults += [*hand.faults(), *sound.faults()]
                    _play_on(sound, model, faults)
                    snapshot = monitor.look()
                    missed = _since(before, bare.ask(Look(), WakeUps))
                    now = time.monotonic()
                    screen.update(_table(snapshot, missed, faults[-3:]), refresh=True)
        except Interrupted as end:
            if end.signal_name != "SIGINT":
                raise
            end.accept()
        finally:
            bare.close()
            for fault in faults:
                print(f"fault: {fault}")
        counted = sound.silence()
    limited = 0 if counted is None else _limited(counted.counters)
    print(_summary(snapshot, missed, now - start, limited=limited))


def _since(before: WakeUps, now: WakeUps) -> WakeUps:
    """What was counted in between."""
    return type(now)(now.periods - before.periods, now.misses - before.misses)


def _play_on(sound: VibrationOutput, model: AnyModel | None, faults: Sequence[str]) -> None:
    """Play again by another process where the one before was lost.

    Raises
    ------
    InputError
        If the vibration was halted: the last of the faults.
    SoundLost
        If nothing can be played.
    """
    if sound.halted:
        raise InputError(faults[-1])
    if sound.pid is None:
        sound.open() if model is None else sound.play(model)


def _grid(model: AnyModel | None) -> tuple[Range, Range] | None:
    """Speeds and forces of a model's conditions, lowest and highest."""
    if model is None:
        return None
    speeds, forces = model.speeds_mm_s, model.forces_n
    return (float(speeds[0]), float(speeds[-1])), (float(forces[0]), float(forces[-1]))


def _table(now: Snapshot, bare: WakeUps, faults: Sequence[str]) -> Table:
    from rich.table import Table
    from rich.text import Text

    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(no_wrap=True, style="bold")
    table.add_column(overflow="fold")
    grid = {None: "", True: ", in the grid", False: ", outside the grid"}[now.in_grid]
    hand = f"{now.speed_mm_s:8.1f} mm/s  {now.force_n:6.2f} N{grid}"
    table.add_row("hand", hand + (f" ({now.hand})" if now.hand else ""))
    bar = "█" * min(40, round(40 * now.peak_g / max(now.limit_g, 1e-9)))
    table.add_row("level", f"{now.rms_g:8.4f} g RMS  {now.peak_g:6.3f} g peak  {bar}")
    table.add_row("at the limit", f"{now.limited_blocks} of {now.blocks} blocks")
    table.add_row("without hand", f"{now.stale_blocks} of {now.blocks} blocks")
    missed = f"{now.misses} of {now.blocks} blocks; a bare thread {bare.misses} of {bare.periods}"
    table.add_row("missed", f"{missed} wake-ups")
    table.add_row("callback", _callback(now))
    table.add_row(
        "delay", f"reading {now.reading_ms:.1f} ms old, output {now.output_ms:.1f} ms, as stated"
    )
    for fault in faults:
        table.add_row(Text("fault", style="red"), Text(fault))
    return table


def _limited(counters: RenderCounters) -> int:
    return counters.limited_peak + counters.limited_rms + counters.limited_duration


def _callback(now: Snapshot) -> str:
    return (
        f"takes {now.share_p50:.1%} of a block (median), {now.share_p999:.1%} in 99.9 % of blocks"
    )


def _summary(now: Snapshot, bare: WakeUps, seconds: float, *, limited: int) -> str:
    return (
        f"{seconds:.1f} s: {now.misses} of {now.blocks} blocks missed (a bare thread "
        f"{bare.misses} of {bare.periods} wake-ups), {now.stale_blocks} without a fresh hand, "
        f"{limited} samples at a limit; the callback {_callback(now)}"
    )
