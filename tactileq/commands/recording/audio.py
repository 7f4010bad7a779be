"""tactileq record --audio: strokes of a hand, recorded by an accelerometer at a sound card."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactileq.commands.recording.imports import imports_before
from tactileq.commands.recording.map import recording_map
from tactileq.commands.recording.more import NOTHING_MORE, further_conditions
from tactileq.modeling.errors import counted
from tactileq.results import CommandRun

if TYPE_CHECKING:
    from rich.console import Console

    from tactileq.rig.devices.hand.settings import HandSettings
    from tactileq.rig.recording.capture.grid import StrokeGrid
    from tactileq.rig.recording.capture.input import InputSettings
    from tactileq.rig.recording.capture.pieces import Plan
    from tactileq.rig.recording.capture.recorder import StrokeRecorder
    from tactileq.rig.shared.setup.rig_file import RigFile

STEP_S = 0.05
MOST_MISSING = 6
WITHOUT_FORCE = ("mouse", "window")


@dataclass(frozen=True)
class HandOptions:
    """What the command line says about the hand, where there is no rig file."""

    kind: str | None = None
    device: str | None = None
    counts_per_mm: float | None = None
    force_n: float | None = None


@dataclass(frozen=True)
class InputOptions:
    """What the command line says about the input; it overrides a rig file."""

    device: str | None = None
    channel: int | None = None
    rate_hz: float | None = None
    g_per_fullscale: float | None = None
    simulated: bool = False


@dataclass(frozen=True)
class HandRecording:
    """What is to be recorded, and with what; `more`: what the model of the recordings asks for."""

    texture: str
    duration_s: float
    repeat: int
    grid: Path | None
    rig: Path | None
    hand: HandOptions
    input: InputOptions
    more: bool = False


def hand_from(rig: RigFile | None, options: HandOptions) -> HandSettings:
    """The hand of a rig file, or that of the command line."""
    settings = _hand_of_options(options) if rig is None else _hand_of_rig(rig, options)
    if settings.kind == "window":
        raise ValueError(
            "expected a hand that is read without a window, got one of kind window; give a tablet, "
            "a mouse or a serial sensor."
        )
    return settings


def _hand_of_rig(rig: RigFile, options: HandOptions) -> HandSettings:
    from tactileq.rig.desk.parts import hand_settings

    if options != HandOptions():
        raise ValueError(
            "expected the hand in the rig file or on the command line, got both; leave out --hand "
            "and its options, or --rig."
        )
    return hand_settings(rig)


def _hand_of_options(options: HandOptions) -> HandSettings:
    from tactileq.rig.devices.hand.settings import HandSettings

    if options.kind is None:
        raise ValueError(
            "expected a device that measures the hand, got neither --rig nor --hand; give a rig "
            "file, or --hand tablet, mouse, serial or scripted."
        )
    return HandSettings(
        kind=options.kind,
        device=options.device,
        counts_per_mm=options.counts_per_mm,
        assumed_force_n=options.force_n,
    )


def input_from(rig: RigFile | None, options: InputOptions) -> InputSettings:
    """The accelerometer of a rig file, with what the command line says otherwise."""
    from tactileq.rig.recording.capture.input import InputSettings

    section = None if rig is None else rig.accelerometer
    scale = options.g_per_fullscale
    if scale is None and section is not None:
        scale = section.g_per_fullscale.value
    if scale is None:
        raise ValueError(
            "expected the acceleration of a full-scale sample of the input, got none; give "
            "--g-per-fullscale in g, or [accelerometer] in the rig file (tactileq rig calibrate)."
        )

    def first(given: Any, name: str, default: Any) -> Any:
        return given if given is not None else getattr(section, name, None) or default

    return InputSettings(
        g_per_fullscale=scale,
        device=first(options.device, "device", None),
        channel=first(options.channel, "channel", 1),
        rate_hz=first(options.rate_hz, "rate_hz", None),
    )


def rig_from(path: Path | None, ran: CommandRun) -> RigFile | None:
    """The rig file, where one is given; the run reads it and what it names."""
    if path is None:
        return None
    from tactileq.rig.shared.setup.rig_file import RigFile

    ran.reads(path)
    ran.reads(*RigFile.load(path).files)
    return RigFile.load(path)  # what it names is read here, too


def record_by_hand(folder: Path, options: HandRecording) -> None:
    """Record strokes until the grid is full, or until the program is asked to end."""
    import numpy as np

    from tactileq.modeling.models.grid import grid_axes
    from tactileq.rig.recording.capture.grid import StrokeGrid
    from tactileq.rig.recording.capture.recorder import check_assumed_force

    if options.more and options.grid is not None:
        raise ValueError(
            f"expected --more or --grid, got both ({options.grid}); leave out --grid, since --more "
            "takes its conditions from the recordings, or leave out --more."
        )
    ran = CommandRun("record --audio")
    ran.reads(options.grid, folder if options.more else None)
    rig = rig_from(options.rig, ran)
    hand, heard = hand_from(rig, options.hand), input_from(rig, options.input)
    if options.more:
        wanted = further_conditions(folder, options.texture)
        if not wanted:
            print(NOTHING_MORE)
            return
        speeds, forces = map(np.array, grid_axes(wanted))
        grid = StrokeGrid(speeds, forces, conditions=wanted)
    else:
        grid = StrokeGrid.default() if options.grid is None else StrokeGrid.load(options.grid)
    if hand.assumed_force_n is not None and (hand.without_pressure or hand.kind in WITHOUT_FORCE):
        check_assumed_force(grid, hand.assumed_force_n)
    if rig is not None and options.input.g_per_fullscale is None:
        print_assumed(rig)
    record_on(grid, folder, options, rig=rig, hand=hand, heard=heard, ran=ran)


def record_on(
    grid: StrokeGrid,
    folder: Path,
    options: HandRecording,
    *,
    rig: RigFile | None,
    hand: HandSettings,
    heard: InputSettings,
    ran: CommandRun,
) -> None:
    """Open the devices, and record until the grid is full."""
    from tactileq.rig.desk.lock import rig_locked
    from tactileq.rig.devices.hand.opening import opened_hand, since_now
    from tactileq.rig.recording.capture.input import AudioInput
    from tactileq.rig.recording.capture.pieces import PieceStore, Plan
    from tactileq.rig.recording.capture.recorder import StrokeRecorder

    alone = nullcontext() if rig is None else rig_locked(rig.rig.name)
    with alone, opened_hand(hand) as (live, reader), AudioInput(heard) as source:
        plan = Plan(
            options.texture,
            grid,
            # Cards state rates that are off by a fraction, and files hold whole ones.
            float(round(source.rate_hz)),
            wanted_s=options.duration_s,
            repeat=options.repeat,
            simulated=options.input.simulated or (rig is not None and rig.simulated),
        )
        settings = settings_of_run(
            folder, plan, hand=asdict(hand), input=asdict(heard), device=source.device_name
        )
        recorder = StrokeRecorder(
            source,
            since_now(live),
            store=PieceStore(folder, plan, provenance=ran.provenance(settings)),
            g_per_fullscale=heard.g_per_fullscale,
            speed_delay_s=hand.filter_delay_s,
        )
        run(recorder, reader.faults)


def settings_of_run(folder: Path, plan: Plan, **settings: Any) -> dict[str, Any]:
    """What the recordings of this run are made by, with what made those before them."""
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    return {
        "texture": plan.texture,
        "grid": plan.grid.to_dict(),
        "rate_hz": plan.rate_hz,
        "duration_s": plan.wanted_s,
        "repeat": plan.repeat,
        "simulated": plan.simulated,
        **settings,
        "added to": imports_before(folder / PROVENANCE_NAME),
    }


def print_assumed(rig: RigFile) -> None:
    """Note that levels depend on a scale that was assumed, not measured."""
    scale = None if rig.accelerometer is None else rig.accelerometer.g_per_fullscale
    if scale is not None and scale.assumed:
        print(
            f"note: the input's scale of {scale.value:g} g per full scale is assumed "
            f"({scale.source}), and so are all levels."
        )


def run(recorder: StrokeRecorder, faults: Callable[[], tuple[str, ...]]) -> None:
    """Record until the grid is full, with a map; then, or when asked to end, report the result."""
    from rich.console import Console

    console = Console()
    before = recorder.store.conditions_recorded
    try:
        with shown_map(recorder, console) as show:
            while not recorder.coverage.complete:
                recorder.step()
                for fault in faults():
                    print(f"warning: {fault}", file=sys.stderr)
                show()
                time.sleep(STEP_S)
    finally:
        recorder.end()
        print_state(recorder, before=before)


@contextmanager
def shown_map(recorder: StrokeRecorder, console: Console) -> Iterator[Callable[[], None]]:
    """A map that stays in its place; in a log, a line for each condition that is recorded."""
    from rich.live import Live as Screen

    if console.is_terminal:
        with Screen(recording_map(recorder), console=console, refresh_per_second=10) as screen:
            yield lambda: screen.update(recording_map(recorder))
        return
    logged = recorder.store.conditions_recorded

    def show() -> None:
        nonlocal logged
        if recorder.store.conditions_recorded > logged:
            logged = recorder.store.conditions_recorded
            of = counted(len(recorder.coverage.grid.conditions), "condition")
            print(f"{logged} of {of} recorded", flush=True)

    yield show


def print_state(recorder: StrokeRecorder, *, before: int) -> None:
    """What was recorded, what is missing, and what was wrong."""
    for warning in recorder.warnings():
        print(f"warning: {warning}", file=sys.stderr)
    store, coverage = recorder.store, recorder.coverage
    new = store.conditions_recorded - before
    print(
        f"{store.conditions_recorded} of {counted(len(coverage.grid.conditions), 'condition')} of "
        f"{store.plan.texture} recorded in {store.folder}, {new} of them in this run"
        + (" (simulated)" if store.simulated else "")
    )
    missing = [f"{speed:g} mm/s at {force:g} N" for speed, force in coverage.missing]
    if missing:
        more = f" and {len(missing) - MOST_MISSING} more" if len(missing) > MOST_MISSING else ""
        print(
            f"missing: {'; '.join(missing[:MOST_MISSING])}{more}; run the command again to continue"
        )
