"""The C law of a force device, tick by tick, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tactileq.rig.machines.force.process import limits_of
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.machines.force.states import Cause, ForceEvent, State
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.live.compiled import compiled

TICK_S = 0.001
WALL = Wall(stiffness_n_per_mm=1.0, width_mm=80.0, length_mm=80.0)


class Law:
    """A `tq_force` and the readings that it is given; positions in mm, in the device's frame."""

    def __init__(self, settings: ForceSettings | None = None, wall: Wall = WALL) -> None:
        module = compiled()
        self.ffi, self.lib = module.ffi, module.lib
        self.settings = settings or ForceSettings()
        self.force: Any = self.ffi.new("tq_force *")
        self.sensed: Any = self.ffi.new("tq_sensed *")
        self.lib.tq_force_start(self.force, limits_of(self.settings))
        self.set_wall(wall)

    def set_wall(self, wall: Wall) -> None:
        """Another wall from now on."""
        given = (
            wall.height_mm,
            wall.stiffness_n_per_mm,
            1e-3 * wall.damping_n_s_per_m,
            wall.width_mm / 2,
            wall.length_mm / 2,
        )
        self.lib.tq_force_set_wall(self.force, self.ffi.new("tq_wall *", given))

    def tick(
        self,
        position_mm: Sequence[float] = (0.0, 0.0, 1.0),
        *,
        step_s: float = TICK_S,
        failed: bool = False,
    ) -> float:
        """One tick; the normal force."""
        self.sensed.position_mm = list(position_mm)
        self.sensed.failed = failed
        self.lib.tq_force_tick(self.force, self.sensed, step_s)
        return float(self.force.normal_n)

    def event(self, event: ForceEvent, cause: Cause = Cause.NONE) -> None:
        """Something is asked for, or failed."""
        self.lib.tq_force_event(self.force, event, cause)

    def to(self, position_mm: Sequence[float], *, ticks: int = 200) -> float:
        """Move there in a straight line, and rest for as long; the normal force."""
        start = [float(value) for value in self.sensed.position_mm]
        for n in range(1, ticks + 1):
            share = n / ticks
            self.tick([a + share * (b - a) for a, b in zip(start, position_mm, strict=True)])
        for _ in range(ticks):
            self.tick(position_mm)
        return float(self.force.normal_n)

    def armed(self) -> Law:
        """Armed, above the wall."""
        self.tick()
        self.event(ForceEvent.ARM)
        return self

    def running(self) -> Law:
        """With the wall shown, above it."""
        self.armed().event(ForceEvent.SHOW)
        return self

    @property
    def state(self) -> State:
        """The present state."""
        return State(self.force.state)

    @property
    def cause(self) -> Cause:
        """Why it let go."""
        return Cause(self.force.cause)

    @property
    def command_n(self) -> list[float]:
        """The command in the device's frame."""
        return [float(value) for value in self.force.command_n]
