"""A plan recorded from its first missing condition to its last (docs/recorder.md#recording)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from tactileq.modeling.errors import InputError
from tactileq.modeling.models.grid import Condition
from tactileq.rig.machines.recorder.driver import Recorder, RecordRefused
from tactileq.rig.machines.recorder.law import WantedRecord, check_conditions
from tactileq.rig.machines.recorder.registers import RecorderCause
from tactileq.rig.machines.recorder.sensors import CLOCK_S, CLOCK_SHARE, Sensor, SensorRefused
from tactileq.rig.machines.recorder.store import Kept, RecorderStore

ATTEMPTS = 3
LONGEST_S = 60.0  # that the recorder holds speed and force
SETTLES_S = 1.0  # until the force does, at the most that a motor bears
WRAP_S = 2**32 / 5000
# These may be different the next time; the others are for somebody to mend first.
REPEATED = (
    RecorderCause.OFF_SPEED,
    RecorderCause.OFF_FORCE,
    RecorderCause.NO_SPEED,
    RecorderCause.NO_FORCE,
    RecorderCause.LINK,
    RecorderCause.HEARTBEAT,
    RecorderCause.HOST,
)


@dataclass
class PlanRun:
    """Records what a store misses.

    Parameters
    ----------
    recorder : Recorder
    sensor : Sensor
    store : RecorderStore
    run_in_s : float
        Before each record.
    tell : callable
        Is told why an attempt was refused.

    Attributes
    ----------
    refused : list of str
        A sentence for each condition that was refused so often that it is missing.
    """

    recorder: Recorder
    sensor: Sensor
    store: RecorderStore
    run_in_s: float = 1.0
    tell: Callable[[str], None] = lambda sentence: None
    refused: list[str] = field(default_factory=list)

    def check(self) -> None:
        """Refuse what the motors cannot do.

        Raises
        ------
        InputError
            With the largest speed or force that holds.
        """
        plan = self.store.plan
        hold_s = self.sensor.hold_s(plan.wanted_s)
        if hold_s > LONGEST_S:
            raise InputError(
                f"expected speed and force to be held for at most {LONGEST_S:g} s, got {hold_s:g} "
                "s; record for a shorter time (--duration), or lower sensor.wait_s."
            )
        held_s = SETTLES_S + self.run_in_s + hold_s
        speeds, forces = zip(*plan.grid.conditions, strict=True)
        check_conditions(self.recorder.law, speeds, forces, duration_s=held_s)

    def run(self, recorded: Callable[[Condition], None] | None = None) -> None:
        """Record every missing condition, and store each record at once.

        Parameters
        ----------
        recorded : callable, optional
            Called with each condition that is stored.

        Raises
        ------
        RecordRefused
            For what somebody has to mend first.
        InputError
            Of `check`, of the sensor, or for clocks that disagree.
        """
        self.check()
        missing = self.store.missing
        if not missing:
            return
        self.store.begin()
        clocks = self._clocks()
        for condition in missing:
            if (kept := self._kept(condition)) is None:
                continue
            self._check_clocks(*clocks)
            self.store.add(kept)
            if recorded is not None:
                recorded(condition)

    def _kept(self, condition: Condition) -> Kept | None:
        """The record of a condition; None where it was refused too often."""
        plan = self.store.plan
        wanted = WantedRecord(
            speed_mm_s=condition[0],
            force_n=condition[1],
            run_in_s=self.run_in_s,
            duration_s=plan.wanted_s,
        )
        for attempt in range(1, ATTEMPTS + 1):
            try:
                record = self.recorder.record(wanted, self.sensor)
                true = self._true()  # before a sensor takes its time
                samples = self.sensor.samples(condition)
            except (RecordRefused, SensorRefused) as refused:
                if isinstance(refused, RecordRefused) and refused.cause not in REPEATED:
                    raise
                last = str(refused)
                self.tell(f"attempt {attempt} of {ATTEMPTS}: {last}")
            else:
                return Kept(condition, samples, record, attempt, true)
        self.refused.append(last)
        return None

    def _true(self) -> tuple[float, float] | None:
        return self.recorder.emerged() if self.recorder.simulated else None

    def _clocks(self) -> tuple[float | None, float]:
        return self.sensor.clock_s(), self.recorder.clock_s()

    def _check_clocks(self, sensor_s: float | None, wire_s: float) -> None:
        """Compare both clocks since the run began."""
        now_s = self.sensor.clock_s()
        if now_s is None or sensor_s is None:
            return
        by_sensor, by_wire = now_s - sensor_s, (self.recorder.clock_s() - wire_s) % WRAP_S
        if abs(by_sensor - by_wire) > CLOCK_S + CLOCK_SHARE * by_wire:
            raise InputError(
                f"expected the clocks of sensor and wire to agree, got {by_sensor:.2f} s and "
                f"{by_wire:.2f} s since the run began; correct sensor.rate_hz, or check the load "
                "of the computer. The present record is not stored."
            )
