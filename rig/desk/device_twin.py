"""A rig in silico with hands that move: the cable device's firmware on simulated mechanics.

As `tactileq.rig.desk.twin`, in virtual time and marked `simulated`, but speed, force and travel are
not prescribed: a simulated hand strokes the virtual wall, which pushes back, and the device renders
under it (docs/cable-device.md#simulated-hands).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from math import inf, nan

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.plan import RenderCounters
from tactileq.modeling.seeds import generator
from tactileq.rig.desk.twin import STEP_S, SimulatedRig
from tactileq.rig.machines.board.virtual import TICK_HZ, VirtualBoard, VirtualTransport
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.models import ANY_DEVICE, device_model
from tactileq.rig.machines.device.registers import (
    DeviceCause,
    DeviceCommand,
    DeviceFlags,
    DeviceSimulation,
    DeviceSource,
    DeviceState,
)
from tactileq.rig.machines.device.virtual import compiled_device
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.interface import (
    SURFACES,
    HandRows,
    PresentationRecord,
    RigReading,
    Stimulus,
    ToneBurst,
    grid_of,
)
from tactileq.rig.shared.wire.conversation import RECORD, Block, Conversation

LOOK_S = 1.5  # that each surface is stroked at least
REACH_S, BACK_S = 2.0, 1.4  # down to the real surface, and up from it
LIFT_S = 0.7  # off a surface: a wall pushes only who comes from above
BEAT_S = 0.05  # between looks at the device while the hand strokes
HISTORY_HZ = 200
LIMITS = Limits(peak=5.0, rms=2.0, duration_s=60.0)
WALL = Wall(stiffness_n_per_mm=0.8, width_mm=300.0, length_mm=300.0)
WORKSPACE_MM = (-200.0, 200.0, -150.0, -10.0)  # down to the real surface
TENSION_N = (1.0, 60.0)  # of a cable; with less a hand that strokes fast makes one slack
# Of a participant's stroke: half its way (mm), strokes a second, how far below the wall the hand
# wants to be (mm).
STROKES = ((25.0, 45.0), (0.6, 1.2), (3.0, 12.0))
_UNIT = 1e-6  # of the device's sums


class DeviceTwin(SimulatedRig):
    """The cable device in virtual time; implements `tactileq.rig.shared.interface.TextureRig`.

    Each time it is opened another participant's hand is at it, with a stroke of its own.

    Parameters
    ----------
    real : mapping of texture name to TextureModel, optional
        The textures that are mounted; without it any.
    seed : int
        Of the vibration's noise and of the hands.
    look_s : float
        How long each surface is stroked at least.
    """

    def __init__(
        self,
        real: Mapping[str, TextureModel] | None = None,
        *,
        seed: int = 0,
        look_s: float = LOOK_S,
    ) -> None:
        super().__init__(real, seed=seed)
        self._look_s = look_s
        self._opened = 0
        self._transport = VirtualTransport(VirtualBoard(compiled_device()))
        self._talk = Conversation(self._transport, DEVICE)
        self._before = RenderCounters()
        self._blocks: list[Block] = []
        self._spans: list[PresentationRecord] = []
        self._fault = False

    @property
    def stated(self) -> Mapping[str, object]:
        """The firmware, its wall and how strokes are drawn; nothing of it is real."""
        version = ".".join(map(str, DEVICE.firmware_version))
        return {
            "Name": "simulated cable device",
            "HandDevice": f"{DEVICE.name} in virtual time, simulated",
            "HandFirmware": f"{DEVICE.name} {version}",
            "Force": "commanded",
            "Walls": {"the wall": asdict(WALL)},
            "LookS": self._look_s,
        }

    def open(self) -> None:
        """Switch a device on, and let another hand take the tool."""
        self._opened += 1
        rng = generator(self._seed, self._opened)
        entropy = int(rng.integers(2**32))
        self._transport = VirtualTransport(VirtualBoard(compiled_device(), entropy=entropy))
        self._talk = Conversation(self._transport, DEVICE)
        self._now, self._blocks, self._spans, self._fault = None, [], [], False
        super().open()
        self._talk.hello()
        stroke = tuple(float(rng.uniform(*limits)) for limits in STROKES)
        for name, value in (
            ("Seed", int(rng.integers(2**63))),
            ("VibrationLimit", LIMITS.peak),
            ("Stroke", stroke),
            ("Workspace", WORKSPACE_MM),
            ("TensionRange", TENSION_N),
            (
                "Wall",
                (0.0, WALL.stiffness_n_per_mm, 0.0, WALL.width_mm / 2, WALL.length_mm / 2),
            ),
            ("EventRate", HISTORY_HZ),
        ):
            self._talk.write(name, value)
        self._talk.write("Command", DeviceCommand.HOME)
        self.arm()

    def arm(self) -> None:
        """Let it push: its hand is simulated, nobody has to confirm."""
        if self._talk.read("State") == DeviceState.FAULT:
            self._talk.write("Command", DeviceCommand.CLEAR)
        if self._talk.read("State") == DeviceState.IDLE:
            self._talk.write("Command", DeviceCommand.ARM)
        self._fault = False

    def spoil(self, what: DeviceSimulation) -> None:
        """Something goes wrong from now on."""
        self._talk.write("Simulate", what)

    def now_s(self) -> float:
        """Since the device was switched on."""
        return self._transport.now_s()

    def present_model(self, model: AnyModel) -> float:
        """Show the wall, and have the device render this model under the hand.

        Raises
        ------
        InputError
            For a model that the device cannot render.
        """
        self._begin("virtual", model.texture, None)
        assert self._now is not None
        speeds, forces = grid_of(model)
        self._now = replace(
            self._now, model_sha256=model.sha256, speeds_mm_s=speeds, forces_n=forces
        )
        assert self._talk.read("RealSize") == ANY_DEVICE.real_size
        upload = device_model(model, ANY_DEVICE, limits=LIMITS)
        self._talk.upload(upload.data, upload.hash)
        self._before = self._counters()
        self._show()
        if not self._fault:
            self._talk.write("Source", DeviceSource.MODEL)
        return self._from_now_on()

    def present_real(self, texture: str) -> float:
        """Let the hand go on to the real surface, without a wall above it."""
        super().present_real(texture)
        self._show()
        self._talk.write("Simulate", DeviceSimulation.BUTTON)
        self._go_on(REACH_S)
        return self._from_now_on()

    def present_signal(self, signal: ToneBurst | Stimulus) -> float:
        """Refused: this twin renders models only.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError(
            "expected a model on the simulated cable device, got a prepared signal; use the "
            "simulated rig for signals."
        )

    def check_stimulus(self, stimulus: Stimulus) -> None:
        """Refused, as by `present_signal`."""
        self.present_signal(stimulus)

    def _show(self) -> None:
        """The wall from now on, unless the device has let go."""
        if self._fault:
            self.break_down("the device has let go and pushes nobody until it is armed again.")
        else:
            self._talk.write("Command", DeviceCommand.SHOW)

    def _from_now_on(self) -> float:
        assert self._now is not None
        now_s = self.now_s()
        self._now = replace(self._now, start_s=now_s, end_s=now_s)
        return now_s

    def silence(self) -> None:
        """Once the hand has stroked long enough: no vibration and no wall."""
        if self._now is None:
            return
        if not self._fault:
            self._go_on(self._now.start_s + self._look_s - self.now_s())
        surface = self._now.surface
        if surface == "virtual" and not self._fault:
            self._talk.write("Source", DeviceSource.NOTHING)
            self._count()
        super().silence()
        self._spans.append(self._ended[-1])
        if surface == "real":
            self._talk.write("Simulate", DeviceSimulation.NONE)
            self._go_on(BACK_S)
        if self._talk.read("State") == DeviceState.RUNNING:
            self._talk.write("Command", DeviceCommand.HIDE)
        self._go_on(LIFT_S)

    def read(self) -> RigReading:
        """Move on by 10 ms, and say where the hand is."""
        self._move_on()
        pressed, self._button = self._button, False
        speed, force = (abs(float(self._talk.read(name))) for name in ("Speed", "Force"))  # type: ignore[arg-type]
        return RigReading(self.now_s(), speed, force, pressed, simulated=True)

    def take_history(self) -> HandRows:
        """The hand since the last call, 200 rows a second of its own time."""
        taken, self._blocks = self._blocks, []
        if not taken:
            return HandRows.joined([])
        # Much faster than concatenating arrays of records.
        values = np.frombuffer(b"".join(block.values.tobytes() for block in taken), RECORD)
        time_s = (
            np.concatenate([b.tick + b.every * np.arange(b.values.size) for b in taken]) / TICK_HZ
        )
        surface, number = np.zeros(values.size, dtype=int), np.zeros(values.size, dtype=int)
        present = [] if self._now is None else [replace(self._now, end_s=inf)]
        for span in (*self._spans, *present):
            own = (span.start_s <= time_s) & (time_s < span.end_s)
            surface[own], number[own] = SURFACES.index(span.surface), span.number
        force = _wide(values["force_n"])
        force[surface == SURFACES.index("real")] = nan  # nothing measures it there
        self._spans = self._spans[-1:]  # rows of the last one may still come
        return HandRows(
            time_s=time_s,
            speed_mm_s=_wide(values["speed_mm_s"]),
            force_n=force,
            surface=surface,
            presentation=number,
            force_assumed=np.zeros(values.size, dtype=bool),
            x_mm=_wide(values["x_mm"]),
            y_mm=np.zeros(values.size),
            depth_mm=_wide(values["depth_mm"]),
            force_commanded=np.ones(values.size, dtype=bool),
            beyond_edge=(values["flags"] & int(DeviceFlags.BEYOND)) > 0,
        )

    def _go_on(self, seconds: float) -> None:
        for _ in range(round(seconds / BEAT_S)):
            if self._fault:
                break
            self._move_on(BEAT_S)

    def _move_on(self, seconds: float = STEP_S) -> None:
        self._talk.write("Heartbeat", 1)
        self._transport.step(round(seconds * TICK_HZ))
        self._blocks += self._talk.blocks()
        if not self._fault and self._talk.read("State") == DeviceState.FAULT:
            self._fault = True
            if self._now is not None and self._now.surface == "virtual":
                self._talk.write("Source", DeviceSource.NOTHING)
                self._count()
            cause = self._talk.read("Cause")
            assert isinstance(cause, int)
            said = DEVICE.masks["Cause"].members[DeviceCause(cause).name][1]
            self.break_down(f"the device let go: {said or DeviceCause(cause).name}.")

    def _count(self) -> None:
        """What the presentation was, by the device's own sums."""
        assert self._now is not None
        ticks, squares, _, peak, _, _ = self._talk.read("Played")  # type: ignore[misc]
        after, before = self._counters(), self._before
        since = {
            field.name: getattr(after, field.name) - getattr(before, field.name)
            for field in fields(RenderCounters)
        }
        self._now = replace(
            self._now,
            counters=RenderCounters(**since),
            played_s=ticks / TICK_HZ,
            dose_g2_s=squares * _UNIT / TICK_HZ,
            peak_g=peak * _UNIT,
        )

    def _counters(self) -> RenderCounters:
        counted = [int(count) for count in self._talk.read("Corrections")]  # type: ignore[union-attr]
        names = [field.name for field in fields(RenderCounters)]
        return RenderCounters(**dict(zip(names, counted, strict=True)))


def _wide(values: Floats) -> Floats:
    return values.astype(np.float64)
