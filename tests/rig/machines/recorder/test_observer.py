"""Both observers on a bare motor, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tactileq.rig.machines.recorder.law import TICK_S
from tactileq.rig.machines.recorder.virtual import compiled_recorder

INERTIA, CONSTANT = 1.6e-5, 0.0273


def known(**changed: float) -> Any:
    values = {
        "step_s": TICK_S,
        "inertia_kg_m2": INERTIA,
        "n_m_per_a": CONSTANT,
        "cut": 200.0,
        "reaction_cut": 200.0,
        **changed,
    }
    return compiled_recorder().ffi.new("tq_motor *", values)


def followed(
    motor: Any,
    *,
    ticks: int,
    inertia: float = INERTIA,
    disturbance: float = 0.0,
    acceleration: float = 0.0,
    delayed: bool = False,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Speed, and both estimates, of a motor of this inertia under the compensated current.

    Where it is delayed the current comes one period late, and the observer does not know it.
    """
    module = compiled_recorder()
    observer = module.ffi.new("tq_observer *")
    speed, current, waiting = 0.0, 0.0, 0.0
    rows = []
    for _ in range(ticks):
        given = waiting if delayed else current
        speed += (CONSTANT * given - disturbance) / inertia * TICK_S
        module.lib.tq_observe(observer, motor, current, speed)
        rows.append((speed, observer.disturbance_n_m, observer.reaction_n_m))
        waiting = current
        current = module.lib.tq_accelerating_a(observer, motor, acceleration)
        if not np.isfinite(current) or abs(speed) > 1e12:
            break
    speeds, disturbances, reactions = np.array(rows).T
    return speeds, disturbances, reactions


def grows(values: np.ndarray) -> bool:
    """Whether the last tenth swings wider than the second one."""
    tenth = len(values) // 10
    return bool(np.ptp(values[-tenth:]) > np.ptp(values[tenth : 2 * tenth]))


@pytest.mark.parametrize(("share", "stable"), [(0.8, True), (1.2, False)])
@pytest.mark.parametrize(("delayed", "bound"), [(False, 2.0), (True, 1.0)])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_the_compensated_loop_is_stable_up_to_its_bound(
    share: float, stable: bool, delayed: bool, bound: float, ratio: float
) -> None:
    """α g T < 2, with a period of delay < 1; α is the nominal inertia over the real one."""
    cut = share * bound / (ratio * TICK_S)
    motor = known(cut=cut, reaction_cut=cut)
    _, found, _ = followed(
        motor, ticks=600, inertia=INERTIA / ratio, disturbance=1e-3, delayed=delayed
    )
    assert grows(found) != stable
    if stable:
        assert found[-1] == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.parametrize("cut", [50.0, 200.0, 1000.0])
def test_a_step_of_disturbance_is_found_as_the_low_pass_says(cut: float) -> None:
    """Without compensation: τ (1 − (1 − gT)ⁿ), exactly."""
    module = compiled_recorder()
    motor, observer = known(cut=cut, reaction_cut=cut), module.ffi.new("tq_observer *")
    torque, speed, found = 2e-3, 0.0, []
    for _ in range(400):
        speed -= torque / INERTIA * TICK_S
        module.lib.tq_observe(observer, motor, 0.0, speed)
        found.append(observer.disturbance_n_m)
    expected = torque * (1 - (1 - cut * TICK_S) ** np.arange(1, 401))
    assert np.array(found) == pytest.approx(expected, rel=1e-9)


def test_the_acceleration_is_the_one_that_was_asked_for() -> None:
    """In spite of a disturbance and of twice the inertia that is known."""
    motor = known(cut=500.0)
    speeds, *_ = followed(
        motor, ticks=2000, inertia=2 * INERTIA, disturbance=5e-3, acceleration=30.0
    )
    assert np.diff(speeds[-500:]).mean() / TICK_S == pytest.approx(30.0, rel=1e-3)


def test_the_reaction_is_the_disturbance_less_friction_and_gravity() -> None:
    motor = known(friction_n_m=1e-3, slow_rad_s=0.1, viscous_n_m_s=2e-6, gravity_n_m=3e-3)
    speeds, disturbances, reactions = followed(motor, ticks=3000, disturbance=0.02)
    friction = 1e-3 * np.sign(speeds[-1]) + 2e-6 * speeds[-1]
    assert abs(speeds[-1]) > 0.1
    assert disturbances[-1] - reactions[-1] == pytest.approx(friction + 3e-3, rel=1e-3)


def test_below_the_slow_speed_nobody_knows_what_friction_holds() -> None:
    motor = known(friction_n_m=1e-3, slow_rad_s=1e9)
    _, disturbances, reactions = followed(motor, ticks=2000, disturbance=0.02)
    assert reactions[-1] == pytest.approx(disturbances[-1], rel=1e-6)
