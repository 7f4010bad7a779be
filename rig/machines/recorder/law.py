"""The recorder's law in plain numbers: motors, limits, what it can do (docs/recorder.md)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_number
from tactileq.modeling.errors import InputError
from tactileq.rig.shared.wire.definition import Value

TICK_S = 1 / 5000
FASTEST_SHARE = 0.93  # of the limit: what an encoder's counts add to the speed must not reach it
RUN_UP_S = 2.0
LEAST_FORCE_N = 0.05


@dataclass(frozen=True, kw_only=True)
class MotorLaw:
    """What the law knows of a motor and what it turns.

    Parameters
    ----------
    inertia_kg_m2, n_m_per_a : float
        Above 0.
    cut, reaction_cut, speed_cut : float
        Of disturbance observer, reaction torque observer and low-pass on the speed, rad/s; above 0,
        at most the rate.
    friction_n_m, viscous_n_m_s, gravity_n_m : float
        Coulomb's and viscous friction (≥ 0), and gravity's torque, as identified.
    slow_rad_s : float
        Below this speed it may stick: Coulomb's friction is not compensated.

    Raises
    ------
    InputError
    """

    inertia_kg_m2: float
    n_m_per_a: float = 0.0273
    cut: float = 200.0
    reaction_cut: float = 200.0
    speed_cut: float = 500.0
    friction_n_m: float = 3e-4
    slow_rad_s: float = 0.2
    viscous_n_m_s: float = 1e-6
    gravity_n_m: float = 0.0

    def __post_init__(self) -> None:
        check_number("inertia_kg_m2", self.inertia_kg_m2, low=1e-9, high=1.0)
        check_number("n_m_per_a", self.n_m_per_a, low=1e-4, high=10.0)
        for name in ("cut", "reaction_cut", "speed_cut"):
            check_number(name, getattr(self, name), low=0.1, high=1 / TICK_S)
        for name in ("friction_n_m", "viscous_n_m_s", "slow_rad_s"):
            check_number(name, getattr(self, name), low=0.0, high=1.0)
        check_number("gravity_n_m", self.gravity_n_m, low=-1.0, high=1.0)

    def row(self) -> tuple[float, ...]:
        """As the registers TableLaw and ArmLaw hold it."""
        return (
            self.inertia_kg_m2,
            self.n_m_per_a,
            self.cut,
            self.reaction_cut,
            self.speed_cut,
            self.friction_n_m,
            self.slow_rad_s,
            self.viscous_n_m_s,
        )


@dataclass(frozen=True, kw_only=True)
class RecorderLaw:
    """The whole law: SI units, all of them assumed until they are measured (docs/recorder.md).

    Parameters
    ----------
    table, arm : MotorLaw
        Turntable and contactor.
    counts : int
        Of an encoder in a turn, 64 … 65536.
    most_a, nominal_a, heat_a2_s : float
        Largest current; the one that a motor bears for ever; integral of the square above it that
        it bears, too.
    arm_m, radius_mm : float
        Lever of the ball; from the turntable's axis to the ball.
    contact_n_per_m : float
        Stiffness of ball and sample for which the force loop is made.
    speed_loop, force_loop : float
        Their band widths, rad/s.
    """

    table: MotorLaw = field(default=MotorLaw(inertia_kg_m2=2.82e-4, cut=60.0, reaction_cut=60.0))
    arm: MotorLaw = field(default=MotorLaw(inertia_kg_m2=1.6e-5, cut=400.0, reaction_cut=400.0))
    counts: int = 4096
    most_a: float = 6.0
    nominal_a: float = 4.12
    heat_a2_s: float = 60.0
    arm_m: float = 0.03
    radius_mm: float = 40.0
    contact_n_per_m: float = 5000.0
    speed_loop: float = 20.0
    force_loop: float = 60.0
    lower_rad_s: float = 0.3
    touch_n: float = 0.15
    lift_rad_s: float = 0.5
    hold_n_m: float = 0.004
    least_counts: int = 10
    tolerance: float = 0.02
    patience_s: float = 12.0
    fastest_rad_s: float = 20.0

    def registers(self) -> dict[str, Value]:
        """As the recorder takes it."""
        return {
            "TableLaw": self.table.row(),
            "ArmLaw": self.arm.row(),
            "Gravity": self.arm.gravity_n_m,
            "CurrentLimits": (self.most_a, self.nominal_a, self.heat_a2_s),
            "Contact": (self.arm_m, self.contact_n_per_m),
            "Loops": (self.speed_loop, self.force_loop),
            "Moves": (self.lower_rad_s, self.lift_rad_s, self.hold_n_m),
            "Bounds": (self.touch_n, self.tolerance, self.patience_s, self.fastest_rad_s),
            "Counts": (self.counts, self.least_counts),
        }

    def largest_force_n(self, duration_s: float) -> float:
        """That the contactor's motor holds for so long, from cold."""
        held_a = sqrt(self.nominal_a**2 + self.heat_a2_s / duration_s)
        return self.arm.n_m_per_a * min(held_a, self.most_a) / self.arm_m

    @property
    def largest_speed_mm_s(self) -> float:
        """Of the sample under the ball."""
        return FASTEST_SHARE * self.fastest_rad_s * self.radius_mm

    @property
    def smallest_speed_mm_s(self) -> float:
        """At which the turntable's index comes within the patience, its run-up taken off."""
        return 2 * pi * self.radius_mm / (self.patience_s - RUN_UP_S)


@dataclass(frozen=True, kw_only=True)
class WantedRecord:
    """One record: a speed at a force.

    Parameters
    ----------
    speed_mm_s, force_n : float
        Above 0.
    run_in_s : float
        From a settled force to the record, above 0.
    duration_s : float
        Above 0.
    """

    speed_mm_s: float
    force_n: float
    run_in_s: float = 1.0
    duration_s: float = 1.0

    def __post_init__(self) -> None:
        for name, high in (
            ("speed_mm_s", 1e4),
            ("force_n", 100.0),
            ("run_in_s", 60.0),
            ("duration_s", 600.0),
        ):
            check_number(name, getattr(self, name), low=1e-3, high=high)


def check_conditions(
    law: RecorderLaw, speeds_mm_s: ArrayLike, forces_n: ArrayLike, *, duration_s: float
) -> None:
    """Refuse conditions that the motors cannot hold for a record with its run-in.

    Raises
    ------
    InputError
        With the largest (or smallest) speed or force that holds.
    """
    check_number(
        "the force of each condition (N)", min(np.ravel(forces_n)), low=LEAST_FORCE_N, high=inf
    )
    speeds: Floats = np.asarray(speeds_mm_s, dtype=np.float64)
    forces: Floats = np.asarray(forces_n, dtype=np.float64)
    most = law.largest_force_n(duration_s)
    if forces.max(initial=-inf) > most:
        raise InputError(
            f"expected forces of at most {_floored(most):g} N, which the contactor's motor holds "
            f"for {duration_s:g} s, got {forces.max():g} N; leave out the larger ones, or hold "
            "them for a shorter time (--duration, sensor.wait_s)."
        )
    if speeds.min(initial=inf) < law.smallest_speed_mm_s:
        raise InputError(
            f"expected speeds of at least {np.ceil(law.smallest_speed_mm_s):g} mm/s, at which the "
            f"turntable's index comes in time at {law.radius_mm:g} mm from its axis, got "
            f"{speeds.min():g} mm/s; leave out the lower ones, or move the contactor inwards."
        )
    if speeds.max(initial=-inf) > law.largest_speed_mm_s:
        raise InputError(
            f"expected speeds of at most {_floored(law.largest_speed_mm_s):g} mm/s, the turntable's"
            f" limit at {law.radius_mm:g} mm from its axis, got {speeds.max():g} mm/s; leave out "
            "the higher ones, or move the contactor outwards."
        )


def _floored(value: float) -> float:
    return float(np.floor(100 * value) / 100)
