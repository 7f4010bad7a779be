"""The recorder in virtual time, on simulated mechanics (docs/recorder.md#what-is-simulated)."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.rig.machines.recorder.law import TICK_S, RecorderLaw, WantedRecord
from tactileq.rig.machines.recorder.registers import RecorderCause, RecorderState

try:
    import tactileq.rig.machines.recorder._recorder as _recorder
except ImportError:  # no compiler at installation
    _recorder = None

MOST_S = 60.0  # of a record with all its phases


def compiled_recorder() -> Any:
    """The module of the compiled law and mechanics.

    Raises
    ------
    InputError
        If there is none.
    """
    if _recorder is None:
        raise InputError(
            "expected the compiled parts of tactileq, which a simulated recorder needs, got none; "
            "install a C compiler (gcc or clang), then tactileq again."
        )
    return _recorder


@dataclass(frozen=True, kw_only=True)
class RecorderParts:
    """What the simulated mechanics are made of; the law may know it wrongly. SI units.

    Parameters
    ----------
    table_kg_m2, disc_kg_m2, arm_kg_m2 : float
        Inertia of the turntable's motor, of the turntable, of the contactor with its motor.
    table_friction_n_m, arm_friction_n_m, viscous_n_m_s, gravity_n_m : float
        Coulomb's friction of both motors, viscous friction, gravity on the contactor.
    coupling_n_m, poles, coupling_n_m_s : float
        Largest torque of the magnets between motor and turntable, pairs of them, damping.
    contact_n_per_m, contact_n_s_per_m, friction : float
        Of the ball on the sample.
    gap_m, wobble_m : float
        Height of the lifted ball; of the sample, up and down once a turn.
    """

    table_kg_m2: float = 7.28e-6
    disc_kg_m2: float = 2.75e-4
    arm_kg_m2: float = 1.6e-5
    n_m_per_a: float = 0.0273
    table_friction_n_m: float = 2e-3
    arm_friction_n_m: float = 3e-4
    viscous_n_m_s: float = 1e-6
    gravity_n_m: float = 0.0
    coupling_n_m: float = 0.3
    poles: float = 4.0
    coupling_n_m_s: float = 2e-3
    counts: int = 4096
    arm_m: float = 0.03
    radius_m: float = 0.04
    contact_n_per_m: float = 5000.0
    contact_n_s_per_m: float = 5.0
    friction: float = 0.3
    gap_m: float = 1.5e-3
    wobble_m: float = 2e-5
    bearing_n_m: float = 2e-3
    ohm: float = 1.0
    k_per_w: float = 10.0
    j_per_k: float = 20.0


@dataclass(frozen=True, eq=False, kw_only=True)
class VirtualRecord:
    """A record of the simulated recorder.

    Parameters
    ----------
    reason : RecorderCause
        NONE where speed and force were held.
    speed_mm_s, force_n, force_sd_n, speed_sd_mm_s : float
        Means and standard deviations of the estimates while it recorded.
    start_turn, end_turn : float
        Where the ball was on the sample, turns since the index, 0 … 1.
    hottest_a2_s : float
        Of both motors.
    true_speed_mm_s, true_force_n : (n,) ndarray
        Of the mechanics, at every tick that was recorded.
    duration_s : float
        With all phases, in virtual time.
    hops : int
        How often the ball left the sample.
    """

    reason: RecorderCause
    speed_mm_s: float
    force_n: float
    force_sd_n: float
    speed_sd_mm_s: float
    start_turn: float
    end_turn: float
    hottest_a2_s: float
    true_speed_mm_s: Floats
    true_force_n: Floats
    duration_s: float
    hops: int


class VirtualRecorder:
    """A recorder, switched on; its turntable goes on from record to record.

    Parameters
    ----------
    law : RecorderLaw
    parts : RecorderParts
    """

    def __init__(self, law: RecorderLaw | None = None, parts: RecorderParts | None = None) -> None:
        module = compiled_recorder()
        self._ffi, self._lib = module.ffi, module.lib
        self.law, self.parts = law or RecorderLaw(), parts or RecorderParts()
        self._recorder = self._ffi.new("tq_recorder *")
        self._plant = self._ffi.new("tq_plant *")
        self._lib.tq_recorder_start(self._recorder, self._limits())
        self._lib.tq_plant_start(self._plant, self._made_of())

    def record(self, wanted: WantedRecord) -> VirtualRecord:
        """One record, with all its phases."""
        want = {**asdict(wanted), "radius_mm": self.law.radius_mm}
        self._lib.tq_recorder_want(self._recorder, self._ffi.new("tq_wanted *", want))
        trace = np.zeros((round(MOST_S / TICK_S), 5))
        into = self._ffi.from_buffer("double *", trace)
        hops = self._plant.hops
        ticks = self._lib.tq_recorder_run(self._recorder, self._plant, len(trace), into, 1)
        rows = trace[:ticks]
        recorded = rows[rows[:, 4] == RecorderState.RECORDS]
        found = self._recorder.found
        reason = RecorderCause(self._recorder.reason)
        if self._recorder.phase not in (RecorderState.RECORDED, RecorderState.FAILS):
            reason = RecorderCause.NO_FORCE
        return VirtualRecord(
            reason=reason,
            speed_mm_s=found.speed_mm_s,
            force_n=found.force_n,
            force_sd_n=found.force_sd_n,
            speed_sd_mm_s=found.speed_sd_mm_s,
            start_turn=found.start_turn,
            end_turn=found.end_turn,
            hottest_a2_s=found.hottest_a2_s,
            true_speed_mm_s=recorded[:, 1].copy(),
            true_force_n=recorded[:, 0].copy(),
            duration_s=ticks * TICK_S,
            hops=self._plant.hops - hops,
        )

    def rest(self, seconds: float) -> None:
        """Let time pass; after a failure the turntable runs down."""
        self._lib.tq_recorder_rest(self._recorder, self._plant, round(seconds / TICK_S))

    def stick(self, *, table: bool = False, arm: bool = False) -> None:
        """Have these encoders stand still, or go on."""
        self._plant.stuck[0], self._plant.stuck[1] = table, arm

    def _limits(self) -> Any:
        law = self.law
        plain = {
            name: getattr(law, name)
            for name in (
                "nominal_a", "heat_a2_s", "arm_m", "contact_n_per_m", "speed_loop", "force_loop",
                "lower_rad_s", "touch_n", "lift_rad_s", "hold_n_m", "least_counts", "tolerance",
                "patience_s", "fastest_rad_s",
            )
        }  # fmt: skip
        motors = [{"step_s": TICK_S, **asdict(motor)} for motor in (law.table, law.arm)]
        counts, most = [law.counts] * 2, [law.most_a] * 2
        return self._ffi.new(
            "tq_recorder_limits *", {**plain, "motor": motors, "counts": counts, "most_a": most}
        )

    def _made_of(self) -> Any:
        made = asdict(self.parts)
        friction = [made.pop("table_friction_n_m"), made.pop("arm_friction_n_m")]
        twice = {name: [made.pop(name)] * 2 for name in ("n_m_per_a", "viscous_n_m_s", "counts")}
        return self._ffi.new("tq_plant_parts *", {**made, **twice, "friction_n_m": friction})
