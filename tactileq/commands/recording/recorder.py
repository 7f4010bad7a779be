"""tactileq record --recorder: a turntable and a contactor record a surface by themselves."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactileq.commands.recording.audio import settings_of_run
from tactileq.commands.recording.more import NOTHING_MORE, further_conditions
from tactileq.modeling.errors import InputError, counted
from tactileq.printing import progress
from tactileq.results import CommandRun

if TYPE_CHECKING:
    from tactileq.modeling.arrays import Floats
    from tactileq.modeling.models.grid import Condition
    from tactileq.rig.machines.recorder.driver import Recorder, RecorderWire, VirtualWire
    from tactileq.rig.machines.recorder.recorder_file import RecorderFile
    from tactileq.rig.machines.recorder.recording import PlanRun
    from tactileq.rig.machines.recorder.sensors import Sensor
    from tactileq.rig.recording.capture.grid import StrokeGrid

COMMAND = "record --recorder"
MOST_REFUSED = 3


@dataclass(frozen=True)
class RecorderRecording:
    """What is to be recorded; `more`: what the model of the recordings asks for."""

    texture: str
    duration_s: float
    repeat: int
    grid: Path | None = None
    rate_hz: float | None = None
    more: bool = False
    seed: int = 0


def record_on_recorder(folder: Path, recorder: str, options: RecorderRecording) -> None:
    """Record what the folder misses, until nothing is missing."""
    from tactileq.rig.machines.recorder.driver import Recorder
    from tactileq.rig.machines.recorder.recorder_file import (
        IN_VIRTUAL_TIME,
        SHIPPED_RECORDER_FILE,
        RecorderFile,
    )

    path = SHIPPED_RECORDER_FILE if recorder == IN_VIRTUAL_TIME else Path(recorder)
    ran = CommandRun(COMMAND)
    own = None if recorder == IN_VIRTUAL_TIME else path
    ran.reads(own, options.grid, folder if options.more else None)
    file = RecorderFile.load(path)
    grid = _grid(folder, options)
    if grid is None:
        print(NOTHING_MORE)
        return
    if file.simulated:
        _check_planted(options.texture)
    elif options.rate_hz is not None:
        raise InputError(
            "expected no --rate with a recorder file, got one; it states sensor.rate_hz."
        )
    # A simulated one is a new one for each run.
    with _held(file), _wire(file, options) as wire:
        device = Recorder(wire, file.law())
        if device.simulated != file.simulated:
            found, write = ("an emulated", "true") if device.simulated else ("a real", "false")
            raise InputError(
                f"expected {'an emulated' if file.simulated else 'a real'} recorder at "
                f"{file.recorder.address}, got {found} one; write recorder.simulated = {write} in "
                f"{file.path}, or correct the address."
            )
        with _sensor(file, device, options) as sensor:
            run = _plan_run(folder, grid, options, file=file, device=device, sensor=sensor, ran=ran)
            _tell(run)


def record_quietly(folder: Path, options: RecorderRecording) -> None:
    """Record a planted texture on the simulated recorder, without a word.

    Raises
    ------
    InputError
        If not all of the grid was recorded.
    """
    from tactileq.rig.machines.recorder.driver import Recorder
    from tactileq.rig.machines.recorder.recorder_file import SHIPPED_RECORDER_FILE, RecorderFile

    ran = CommandRun(COMMAND)
    ran.reads(options.grid)
    file = RecorderFile.load(SHIPPED_RECORDER_FILE)
    grid = _grid(folder, options)
    assert grid is not None
    device = Recorder(_virtual(options), file.law())
    with _sensor(file, device, options) as sensor:
        run = _plan_run(folder, grid, options, file=file, device=device, sensor=sensor, ran=ran)
        run.run()
    if run.refused:
        raise InputError(run.refused[0])


def _grid(folder: Path, options: RecorderRecording) -> StrokeGrid | None:
    """The conditions; None where nothing more is asked for."""
    import numpy as np

    from tactileq.modeling.models.grid import grid_axes
    from tactileq.rig.recording.capture.grid import StrokeGrid

    if options.more:
        if options.grid is not None:
            raise InputError(
                f"expected --more or --grid, got both ({options.grid}); leave out --grid, since "
                "--more takes its conditions from the recordings, or leave out --more."
            )
        wanted = further_conditions(folder, options.texture)
        if not wanted:
            return None
        speeds, forces = map(np.array, grid_axes(wanted))
        return StrokeGrid(speeds, forces, conditions=wanted)
    return StrokeGrid.default() if options.grid is None else StrokeGrid.load(options.grid)


def _check_planted(texture: str) -> None:
    from tactileq.modeling.errors import shown
    from tactileq.stimuli.planted.textures import TEXTURES

    if texture not in TEXTURES:
        raise InputError(
            "expected a planted texture for a simulated recorder, one of "
            f"{', '.join(TEXTURES)}, got {shown(texture)}; choose one, or give the file of a real "
            "recorder."
        )


@contextmanager
def _held(file: RecorderFile) -> Iterator[None]:
    """The recorder for this process alone; one in virtual time is its own."""
    from tactileq.rig.desk.lock import rig_locked
    from tactileq.rig.machines.recorder.recorder_file import IN_VIRTUAL_TIME

    if file.recorder.address == IN_VIRTUAL_TIME:
        yield
        return
    with rig_locked(file.recorder.name):
        yield


@contextmanager
def _wire(file: RecorderFile, options: RecorderRecording) -> Iterator[RecorderWire]:
    """The way to the recorder, open."""
    from tactileq.rig.machines.recorder.definition import RECORDER
    from tactileq.rig.machines.recorder.driver import LinkedWire
    from tactileq.rig.machines.recorder.recorder_file import IN_VIRTUAL_TIME
    from tactileq.rig.shared.wire.link import Link
    from tactileq.rig.shared.wire.transports import opened_transport

    address, baud = file.recorder.address, file.recorder.baud
    if address == IN_VIRTUAL_TIME:
        yield _virtual(options)
        return
    with Link(lambda: opened_transport(address, baud), RECORDER) as link:
        yield LinkedWire(link)


def _virtual(options: RecorderRecording) -> VirtualWire:
    """A recorder in virtual time, with what seed, texture and repeat mount."""
    from tactileq.modeling.seeds import noise_stream
    from tactileq.rig.machines.recorder.driver import VirtualWire

    mounted = noise_stream(str(options.seed), options.texture, str(options.repeat))
    return VirtualWire(entropy=mounted % 2**32)


@contextmanager
def _sensor(file: RecorderFile, device: Recorder, options: RecorderRecording) -> Iterator[Sensor]:
    """What measures the vibration, open."""
    from tactileq.rig.machines.recorder.sensors import (
        DrawnVibration,
        EvaluationFiles,
        SoundCardSensor,
    )
    from tactileq.rig.recording.capture.input import AudioInput, InputSettings

    settings = file.sensor
    if file.simulated:
        rate_hz = settings.rate_hz if options.rate_hz is None else options.rate_hz
        yield DrawnVibration(rate_hz, device.emerged, _drawing(options, rate_hz))
    elif (files := file.sensor_folder) is not None:
        yield EvaluationFiles(
            files,
            rate_hz=settings.rate_hz,
            axis=settings.axis,
            wait_s=settings.wait_s,
            tell=_say,
        )
    elif settings.device is not None and settings.g_per_fullscale is not None:
        heard = InputSettings(
            g_per_fullscale=settings.g_per_fullscale.value,
            device=settings.device,
            channel=settings.channel,
            rate_hz=settings.rate_hz,
        )
        with AudioInput(heard) as source:
            yield SoundCardSensor(source)
    else:
        raise InputError(
            f"expected sensor.files or sensor.device in {file.path} of a real recorder, got "
            "neither; say how the accelerometer is read."
        )


def _drawing(options: RecorderRecording, rate_hz: float) -> Any:
    """Draws the planted texture's vibration at the speed and force that emerged."""
    from tactileq.modeling.seeds import noise_stream
    from tactileq.rig.recording.capture.grid import StrokeGrid
    from tactileq.stimuli.planted.textures import vibration_at

    usual = StrokeGrid.default().conditions

    def draw(speed_mm_s: float, force_n: float, duration_s: float, condition: Condition) -> Floats:
        # Of the usual grid those of records in silico.
        first = options.repeat == 1 and condition in usual
        named = noise_stream(f"{condition[0]:g}", f"{condition[1]:g}", str(options.repeat))
        return vibration_at(
            options.texture,
            (speed_mm_s, force_n),
            rate_hz=rate_hz,
            duration_s=duration_s,
            seed=options.seed,
            stream=usual.index(condition) if first else named,
        )

    return draw


def _plan_run(
    folder: Path,
    grid: StrokeGrid,
    options: RecorderRecording,
    *,
    file: RecorderFile,
    device: Recorder,
    sensor: Sensor,
    ran: CommandRun,
) -> PlanRun:
    """What is still to be recorded into the folder."""
    from tactileq.rig.machines.recorder.recording import PlanRun
    from tactileq.rig.machines.recorder.store import TABLE_NAME, RecorderStore
    from tactileq.rig.recording.capture.pieces import Plan

    plan = Plan(
        options.texture,
        grid,
        sensor.rate_hz,
        wanted_s=options.duration_s,
        repeat=options.repeat,
        simulated=file.simulated,
    )
    settings = settings_of_run(
        folder,
        plan,
        recorder=file.recorder.name,
        law=asdict(file.law()),
        conditions=f"as commanded; what was held stands in {TABLE_NAME}",
    )
    seed = options.seed if file.simulated else None
    store = RecorderStore(
        folder,
        plan,
        radius_mm=file.sample.radius.value,
        provenance=ran.provenance(settings, seed=seed),
        seed=seed,
    )
    return PlanRun(device, sensor, store, file.sample.run_in_s, tell=_say)


def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr, flush=True)


def _tell(run: PlanRun) -> None:
    """Record what is missing, with a progress bar and a summary."""
    store = run.store
    for sentence in store.damaged:
        print(f"warning: {sentence}", file=sys.stderr)
    plan = store.plan
    before, of = len(store.missing), len(plan.grid.conditions)
    try:
        with progress(f"Recording {plan.texture}", before) as advance:
            run.run(lambda at: advance(f"{at[0]:g} mm/s at {at[1]:g} N"))
    finally:
        left = len(store.missing)
        print(
            f"{of - left} of {counted(of, 'condition')} of {plan.texture} recorded in "
            f"{store.folder}, {before - left} of them in this run"
            + (" (simulated)" if plan.simulated else "")
        )
    for sentence in run.refused[:MOST_REFUSED]:
        print(f"warning: {sentence}", file=sys.stderr)
    if run.refused:
        raise InputError(
            f"expected all conditions to be held, got {len(run.refused)} refused; mend what the "
            "warnings say, then run the command again to continue."
        )
