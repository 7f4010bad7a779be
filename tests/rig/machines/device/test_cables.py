"""The firmware on the mechanics: what the hand feels, slack cables, the button, vibration, heat."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.device.geometry import CableGeometry
from tactileq.rig.machines.device.registers import (
    DeviceCause,
    DeviceCommand,
    DeviceFlags,
    DeviceSimulation,
    DeviceSource,
    DeviceState,
)
from tactileq.rig.machines.device.virtual import compiled_device
from tests.rig.machines.device.talking import Talk, joined

X, Z, LEFT, RIGHT, HAND, _, _, WARM, _, RMS = range(10)  # of the register Emerged
GEOMETRY = CableGeometry()
HAND_N_PER_MM = 0.3
FRICTION_N = 0.1  # of a motor, at its cable
CABLE_N = 45_000.0  # per strain
COUNT_MM = 2 * np.pi * 10 / 4096


def shown(stroke: tuple[float, float, float], *, seconds: float = 1.5) -> Talk:
    """A device whose simulated hand has stroked the wall for so long."""
    talk = Talk()
    talk.write("FrozenTime", 5.0)
    talk.write("Stroke", stroke)
    for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
        talk.ask(command)
    talk.run(seconds)
    return talk


def emerged(talk: Talk) -> np.ndarray:
    return np.array(talk.number("Emerged"))


@pytest.mark.parametrize("press_mm", [2.0, 8.0, 16.0])
def test_the_hand_feels_the_walls_force_within_friction_and_a_count(press_mm: float) -> None:
    """Statically; wall, cables and hand are springs in series. A count is 0.05 mm of height."""
    talk = shown((0.0, 0.5, press_mm), seconds=2.5)
    found, force = emerged(talk), talk.number("Force")
    length = np.hypot(300, found[Z])
    up = -found[Z] / length
    wrong = 2 * FRICTION_N * up + 1.0 * COUNT_MM / (2 * up)
    assert abs(found[HAND] - force) < wrong
    tensions = GEOMETRY.exact_tensions_n([0.0, found[Z]], [0.0, force])
    assert found[[LEFT, RIGHT]] == pytest.approx(tensions, abs=wrong / (2 * up))
    cables = 2 * CABLE_N / length * up**2
    holds = 2 * 0.3 * 30 / np.hypot(300, 30)  # the hand bears at rest what the springs pull
    series = (press_mm + holds / HAND_N_PER_MM) / (1 / HAND_N_PER_MM + 1 + 1 / cables)
    assert found[HAND] == pytest.approx(series, abs=wrong)
    assert -50 - found[Z] == pytest.approx(force * (1 + 1 / cables), abs=wrong * (1 + 1 / cables))


# --- Slack cables -------------------------------------------------------------------------------


@pytest.mark.parametrize("press_mm", [0.3, 1.0, 4.0, 10.0, 20.0])
def test_a_cut_cable_lets_go_with_its_cause_and_is_seen_in_the_records(press_mm: float) -> None:
    """Below 0.06 s, by the estimate of its tension, or before by the speed of a motor that runs
    away."""
    talk = shown((40.0, 0.5, press_mm))
    before = joined(talk.recorded(2.2))
    assert not (before["flags"] & DeviceFlags.SLACK).any()
    begun = talk.number("Tick")
    talk.spoil(DeviceSimulation.SLACK)
    after = joined(talk.listened(0.4))
    assert (after["flags"] & DeviceFlags.SLACK).any()
    assert talk.state == DeviceState.FAULT
    assert talk.cause in (DeviceCause.SLACK, DeviceCause.SPEED)
    assert 0 < talk.number("FaultTick") - begun < 0.06 * TICK_HZ
    assert talk.number("ZeroTick") - talk.number("FaultTick") <= 101
    assert emerged(talk)[LEFT] == 0


def test_strokes_that_are_faster_than_the_motors_wind_let_go() -> None:
    """In the air: 0.3 N of the springs, less friction, accelerate a rotor by 2.7 m/s², and a stroke
    of 40 mm at 2 Hz needs 6.3."""
    talk = shown((40.0, 2.0, 0.0))
    assert (talk.state, talk.cause) == (DeviceState.FAULT, DeviceCause.SLACK)
    talk = Talk()
    talk.write("TensionRange", (1.5, 16.0))
    talk.write("Stroke", (40.0, 2.0, 0.0))
    for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
        talk.ask(command)
    values = joined(talk.recorded(2.0))
    assert talk.state == DeviceState.RUNNING
    assert np.ptp(values["x_mm"]) > 40
    assert not (values["flags"] & DeviceFlags.SLACK).any()


def test_cables_stay_taut_without_a_current() -> None:
    """The springs on the pulleys take them up when it has let go: it may be armed again."""
    talk = shown((40.0, 0.5, 4.0))
    talk.ask(DeviceCommand.STOP)
    talk.run(1.0)
    found = emerged(talk)
    assert talk.read("Current") == (0.0, 0.0)
    assert min(found[[LEFT, RIGHT]]) > 0.1
    assert talk.read("Position") == pytest.approx(found[[X, Z]], abs=0.15)
    for command in (DeviceCommand.CLEAR, DeviceCommand.NONE):
        talk.ask(command)
    talk.run(0.1)
    assert talk.ask(DeviceCommand.ARM) == DeviceState.ARMED


# --- What cables cannot give --------------------------------------------------------------------


@pytest.mark.parametrize(("least", "most"), [(0.2, 16.0), (1.5, 16.0), (0.2, 2.0)])
def test_forces_that_cables_cannot_give_are_marked(least: float, most: float) -> None:
    """As `CableGeometry.pull` marks them; the springs on the pulleys are a least tension, too."""
    geometry = CableGeometry(least_n=max(least, 0.3), most_n=most)
    talk = Talk()
    talk.write("TensionRange", (least, most))
    for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
        talk.ask(command)
    values = joined(talk.recorded(1.0))
    marks = []
    for row in values[values["force_n"] > 0]:
        place, force = (row["x_mm"], -50.0 - row["depth_mm"]), (0.0, row["depth_mm"])  # 1 N/mm
        tensions = geometry.exact_tensions_n(place, force)
        edges = np.abs(tensions[:, None] / (geometry.least_n, geometry.most_n) - 1)
        if row["depth_mm"] > 0 and edges.min() > 0.01:
            marks.append(geometry.pull(place, force).clipped)
            assert bool(row["flags"] & DeviceFlags.CLIPPED) == marks[-1], (row, tensions)
    assert set(marks) == {True, False}


# --- The button ---------------------------------------------------------------------------------


def test_the_button_switches_the_wall_off_and_the_real_surface_is_touched() -> None:
    talk = Talk()
    talk.write("Workspace", (-210.0, 210.0, -145.0, -5.0))
    talk.push()
    talk.spoil(DeviceSimulation.BUTTON)
    values = joined(talk.recorded(2.5))
    assert talk.state == DeviceState.RUNNING
    assert talk.number("Button") == 1
    found = emerged(talk)
    # Two springs: 4 mm of the hand's goal, of 0.3 N/mm, on 1 N/mm.
    assert -130 - found[Z] == pytest.approx(4 * 0.3 / 1.3, abs=0.2)
    assert found[HAND] > 0.7
    assert values["force_n"][-1] == 0
    assert values["flags"][-1] == DeviceFlags.BUTTON | DeviceFlags.SIMULATED
    ramp = values["force_n"][: TICK_HZ // 2]
    assert np.diff(ramp).min() > -0.2  # no step but that of counts
    # From below the wall is not there again, until the tool has come above it.
    talk.spoil(DeviceSimulation.NONE)
    rising = joined(talk.listened(1.0))
    assert rising["flags"][TICK_HZ // 2] & DeviceFlags.BEYOND
    below = rising[rising["depth_mm"] > 10]
    assert below.size > 1000
    assert not below["force_n"].any()
    assert talk.state == DeviceState.RUNNING


# --- Vibration and heat -------------------------------------------------------------------------


def test_the_vibration_at_the_tool_is_that_of_the_resonance() -> None:
    """A sine of 80 Hz: the converter is given 0.2 g, and the tool gets three times that."""
    talk = Talk()
    tone = 0.2 * np.sin(2 * np.pi * 80 * np.arange(4000) / TICK_HZ)
    parts = list(tone.reshape(-1, 25).tolist())
    for part in parts[:30]:
        talk.write("Samples", tuple(part))
    talk.write("Source", DeviceSource.HOST)
    for part in parts[30:]:
        while talk.number("SamplesQueued") > 700:
            pass
        talk.write("Samples", tuple(part))
    assert emerged(talk)[RMS] == pytest.approx(3 * 0.2 / np.sqrt(2), rel=0.05)


def test_windings_warm_by_their_currents() -> None:
    """0.6 Ω and 20 J/K; over a few seconds nothing of it is lost."""
    talk = shown((0.0, 0.5, 20.0), seconds=2.0)
    before, (current, _) = emerged(talk)[WARM], talk.number("Current")
    talk.run(2.0)
    warmed = 0.6 * current**2 * 2.0 / 20
    assert emerged(talk)[WARM] - before == pytest.approx(warmed, rel=0.05)


def test_what_the_firmware_knows_is_what_the_board_is_made_of() -> None:
    lib = compiled_device().lib
    cables, parts = lib.tq_usual_cables(), lib.tq_usual_mechanics()
    assert cables.motor_kg == pytest.approx(parts.rotor_kg_m2 / (1e-3 * parts.pulley_mm) ** 2)
    assert cables.n_per_a == pytest.approx(parts.n_m_per_a / (1e-3 * parts.pulley_mm))
    assert cables.mm_per_count == pytest.approx(2 * np.pi * parts.pulley_mm / 4096)
    assert cables.damping_n_s_per_mm == parts.tool_n_s_per_mm
    assert cables.rewind_n == 0  # of a board; the simulated one says what it has
