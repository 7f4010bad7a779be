"""The simulated cable device's mechanics (mechanics.h): alone against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.device.geometry import CableGeometry
from tactileq.rig.machines.device.virtual import compiled_device
from tactileq.stimuli.planted.vibrators import SimulatedVibrator

TICK_S = 1 / TICK_HZ
GEOMETRY = CableGeometry()
LEFT, RIGHT = 0, 1
LOSSLESS = {
    "friction_n_m": 0.0,
    "viscous_n_m_s": 0.0,
    "rewind_n": 0.0,
    "cable_n_s_per_mm": 0.0,
    "tool_n_s_per_mm": 0.0,
    "surface_n_s_per_mm": 0.0,
    "noise_g": 0.0,
}


class Mechanics:
    """One of them, made of the usual parts but for those given."""

    def __init__(self, **parts: float) -> None:
        module = compiled_device()
        self.ffi, self.lib = module.ffi, module.lib
        self.cables = self.ffi.new("tq_cables *", self.lib.tq_usual_cables())
        made = self.ffi.new("tq_mechanics_parts *", self.lib.tq_usual_mechanics())
        for name, value in parts.items():
            setattr(made, name, value)
        self.state = self.ffi.new("tq_mechanics *")
        self.lib.tq_mechanics_start(self.state, made, self.cables)
        self.parts = self.state.parts

    def to(self, z_mm: float) -> None:
        """Stand there, at x = 0, with the cables as they lie."""
        self.state.z_mm = z_mm
        for n in (LEFT, RIGHT):
            self.state.paid_mm[n] = np.hypot(300.0, z_mm) - self.state.rest_mm[n]

    def tick(
        self, current_a: Any = (0.0, 0.0), push_n: Any = (0.0, 0.0), *, drive_g: float = 0.0
    ) -> None:
        """One, under these."""
        self.lib.tq_mechanics_tick(self.state, self.cables, current_a, push_n, drive_g)

    def rest(self, push_n: tuple[float, float], *, seconds: float) -> None:
        """Let it come to rest under this push."""
        for _ in range(round(seconds * TICK_HZ)):
            self.tick((0.0, 0.0), push_n)

    @property
    def motor_kg(self) -> float:
        """A rotor, as the cable feels it."""
        return float(self.parts.rotor_kg_m2 / (1e-3 * self.parts.pulley_mm) ** 2)


# --- Motors and cables --------------------------------------------------------------------------


@pytest.mark.parametrize("current_a", [0.02, 0.03, 0.2, 1.0, 20.0])
def test_a_free_motor_winds_as_current_and_friction_say(current_a: float) -> None:
    """½ (K i/r − τ/r)/m t² once the current is beyond friction, not at all below; at most 10 A."""
    one = Mechanics(rewind_n=0.0, viscous_n_m_s=0.0)
    one.state.cut[LEFT] = 1
    ticks = 50
    for _ in range(ticks):
        one.tick((current_a, 0.0))
    pull = 2.73 * min(current_a, 10.0) - 0.1
    wound = 0.5 * max(pull, 0.0) / one.motor_kg * 1e3 * (ticks * TICK_S) ** 2
    assert -one.state.paid_mm[LEFT] == pytest.approx(wound, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(("share", "slack"), [(0.6, False), (2.5, True)])
def test_a_cable_is_slack_where_the_tool_is_lifted_faster_than_its_motor_winds(
    share: float, slack: bool
) -> None:
    """Its motor then winds freely, by (K i + spring − τ)/m, and the reading is below the tool."""
    one = Mechanics(viscous_n_m_s=0.0)
    one.to(-50.0)
    s, current = one.state, 0.1
    winds = (2.73 * current + 0.3 - 0.1) / one.motor_kg * 1e3  # mm/s²
    for _ in range(50):  # taut
        s.z_mm, s.vz_mm_s = -50.0, 0.0
        one.tick((current, current))
    before, ticks = s.slacks[LEFT], 100
    jerk = share * winds / (50 / np.hypot(300.0, 50.0)) / (ticks * TICK_S)
    for time_s in TICK_S * np.arange(ticks):  # the tool is where the hand takes it
        s.z_mm, s.vz_mm_s = -50 + jerk * time_s**3 / 6, jerk * time_s**2 / 2
        speed = s.paid_mm_s[LEFT]
        one.tick((current, current))
    counted = [one.lib.tq_mechanics_counted(s, one.cables, n) for n in (LEFT, RIGHT)]
    lengths = GEOMETRY.lengths_mm([0.0, -30.0]) + np.array(counted) * one.cables.mm_per_count
    below = s.z_mm - GEOMETRY.place_mm(lengths)[1]
    assert list(s.slack) == [slack, slack]
    assert (s.slacks[LEFT] > before) == slack
    faster = (speed - s.paid_mm_s[LEFT]) / TICK_S
    if slack:
        assert s.tension_n[LEFT] == 0
        assert faster == pytest.approx(winds, rel=1e-6)
        assert below > 0.3
    else:
        assert s.tension_n[LEFT] > 0.05
        assert faster < winds
        assert abs(below) < 0.1  # one count is 0.09 mm of height


def energy(one: Mechanics, push_n: float) -> float:
    """Of tool, rotors, cables, real surface and a constant push, N·mm."""
    s, p = one.state, one.parts
    moving = p.tool_kg * (s.vx_mm_s**2 + s.vz_mm_s**2) + one.motor_kg * sum(
        speed**2 for speed in s.paid_mm_s
    )
    loose = np.array(list(s.rest_mm)) + list(s.paid_mm)
    stretch = np.maximum(GEOMETRY.lengths_mm([s.x_mm, s.z_mm]) - loose, 0.0)
    deep = max(0.0, p.surface_z_mm - s.z_mm)
    stop = max(0.0, deep - p.travel_mm)
    held = float(np.sum(p.strain_n * stretch**2 / loose)) + p.surface_n_per_mm * deep**2
    return 5e-4 * moving + 0.5 * (held + p.stop_n_per_mm * stop**2) - push_n * s.z_mm


@pytest.mark.parametrize("lossless", [True, False])
def test_energy_is_kept_without_losses_and_only_lost_with_them(lossless: bool) -> None:
    """A tool that is pushed down on cables, unwinds them, and falls on the real surface."""
    one = Mechanics(**(LOSSLESS if lossless else {"rewind_n": 0.0}))
    one.state.vx_mm_s, push, lowest = 80.0, -3.0, 0.0
    before, found = energy(one, push), []
    for _ in range(4000):
        one.tick((0.0, 0.0), (0.0, push))
        found.append(energy(one, push))
        lowest = min(lowest, one.state.z_mm)
    fell = push * (one.parts.surface_z_mm + 30)
    assert lowest < one.parts.surface_z_mm
    if lossless:
        assert np.abs(np.array(found) - before).max() < 0.01 * fell
    else:
        assert np.diff(found).max() < 1e-3 * fell
        assert found[-1] < before - 0.1 * fell


# --- The real surface ---------------------------------------------------------------------------


def test_the_real_surface_gives_way_as_its_springs_and_then_its_stop_do() -> None:
    """Pushed with a known force, without cables: 1 N/mm over 10 mm, then 51."""
    one = Mechanics(surface_n_s_per_mm=0.02)
    one.state.cut[LEFT] = one.state.cut[RIGHT] = 1
    one.state.z_mm = -130.0
    deep = []
    for force in (2.0, 8.0, 20.0, 71.0):
        one.rest((0.0, -force), seconds=0.5)
        deep.append(-130.0 - one.state.z_mm)
        assert one.state.surface_n == pytest.approx(force, rel=1e-3)
    assert deep == pytest.approx([2.0, 8.0, 10 + 10 / 51, 10 + 61 / 51], rel=2e-3)


# --- Heat ---------------------------------------------------------------------------------------


def test_a_winding_warms_by_its_power_with_its_time_constant() -> None:
    """R i² R_th (1 − exp(−t/R_th C)), here with a heat capacity that makes it 0.2 s."""
    one = Mechanics(j_per_k=0.02)
    current, final = 4.12, 0.6 * 4.12**2 * 10
    found = []
    for _ in range(2000):
        one.tick((current, 0.0))
        found.append(one.state.above_k[LEFT])
    time_s = TICK_S * np.arange(1, 2001)
    assert np.array(found) == pytest.approx(final * (1 - np.exp(-time_s / 0.2)), rel=1e-3)
    assert one.state.above_k[RIGHT] == 0
    usual = Mechanics().parts
    assert usual.k_per_w * usual.j_per_k == pytest.approx(200.0)


# --- The vibrator -------------------------------------------------------------------------------


def response(one: Mechanics, hz: float, amplitude_g: float) -> complex:
    """Acceleration per drive at a frequency, over whole periods after it has settled."""
    settle, whole = 2000, TICK_HZ // 5
    turn = np.exp(2j * np.pi * hz * TICK_S * np.arange(settle + whole))
    read = np.zeros(settle + whole)
    for n, drive in enumerate(amplitude_g * turn.imag):
        one.tick(drive_g=drive)
        read[n] = one.state.vibration_g
    sine = turn[settle:]
    return complex(2j * np.mean(read[settle:] / sine) / amplitude_g)


@pytest.mark.parametrize("hz", [20.0, 60.0, 80.0, 100.0, 400.0])
def test_the_vibrator_responds_as_a_mass_on_a_spring(hz: float) -> None:
    """That of tactileq.stimuli.planted.vibrators: 80 Hz, quality 3, gain 1 far above."""
    one = Mechanics(noise_g=0.0)
    planted = SimulatedVibrator(80.0, 3.0, float(TICK_HZ)).response([hz])[0]
    assert abs(response(one, hz, 0.5)) == pytest.approx(abs(planted), rel=0.01)
    if hz == 80.0:
        assert abs(planted) == pytest.approx(3.0, rel=1e-3)


def test_converter_and_sensor_clip() -> None:
    """The drive at 20 g, of which three times would be 60 g, the sensor at 50 g."""
    found = {}
    for drive in (10.0, 100.0):
        one = Mechanics(noise_g=0.0)
        peak = 0.0
        for n in range(2000):
            one.tick(drive_g=drive * np.sin(2 * np.pi * 80 * n * TICK_S))
            peak = max(peak, abs(one.state.vibration_g))
        found[drive] = peak
    assert found[10.0] == pytest.approx(30.0, rel=0.01)
    assert found[100.0] == 50.0


def test_the_sensor_is_as_noisy_as_it_is_said_to_be() -> None:
    one = Mechanics(noise_g=0.02)
    read = []
    for _ in range(8000):
        one.tick()
        read.append(one.state.vibration_g)
    assert np.std(read) == pytest.approx(0.02, rel=0.05)
    assert abs(np.mean(read)) < 0.001


# --- The wall on a free tool --------------------------------------------------------------------

LOAD_N, DAMPING = 2.0, 0.0005
STILL = {name: 0.0 for name in ("friction_n_m", "viscous_n_m_s", "rewind_n", "noise_g")}


def wall_currents(paid_mm: np.ndarray, stiffness: float, rest_mm: np.ndarray) -> np.ndarray:
    """The firmware's law on unquantised encoders: place, F = K depth, tensions, currents."""
    place = GEOMETRY.place_mm(rest_mm + paid_mm)
    force = stiffness * max(0.0, -50 - place[1])
    return GEOMETRY.exact_tensions_n(place, [0.0, force]) / 2.73


def balance(one: Mechanics, stiffness: float) -> np.ndarray:
    """The state x, z, both lengths paid out, and their speeds, in which nothing moves."""
    rest = np.array(list(one.state.rest_mm))
    place = np.array([0.0, -50 - LOAD_N / stiffness])
    for _ in range(50):
        tension = GEOMETRY.exact_tensions_n(place, [0.0, LOAD_N])
        lengths = GEOMETRY.lengths_mm(place) / (1 + tension / one.parts.strain_n)
        reading = GEOMETRY.place_mm(lengths)
        place[1] += -50 - LOAD_N / stiffness - reading[1]
    return np.array([*place, *(lengths - rest), *np.zeros(4)])


def changes(one: Mechanics, state: np.ndarray, current: np.ndarray) -> np.ndarray:
    """Their derivatives, written apart from the C: mm, mm/s, mm/s²."""
    p = one.parts
    place, paid, speed, paying = state[:2], state[2:4], state[4:6], state[6:]
    loose = np.array(list(one.state.rest_mm)) + paid
    jacobian = GEOMETRY.jacobian(place)
    tension = p.strain_n * (GEOMETRY.lengths_mm(place) - loose) / loose
    tension = tension + p.cable_n_s_per_mm * (jacobian @ speed - paying)
    tool = np.array([0.0, -LOAD_N]) - jacobian.T @ tension - p.tool_n_s_per_mm * speed
    motors = tension - 2.73 * current
    return np.concatenate([speed, paying, 1e3 * tool / p.tool_kg, 1e3 * motors / one.motor_kg])


def slopes(of: Any, at: np.ndarray) -> np.ndarray:
    """Jacobian by central differences."""
    step = 1e-5
    columns = [(of(at + d) - of(at - d)) / (2 * step) for d in step * np.eye(at.size)]
    return np.stack(columns, axis=1)


def radius(stiffness: float, delay: int, **parts: float) -> float:
    """Largest eigenvalue of the sampled loop: mechanics exact between ticks, current held."""
    one = Mechanics(**STILL, tool_n_s_per_mm=DAMPING, **parts)
    rest, at = np.array(list(one.state.rest_mm)), balance(one, stiffness)
    current = wall_currents(at[2:4], stiffness, rest)
    a = slopes(lambda s: changes(one, s, current), at)
    b = slopes(lambda i: changes(one, at, i), current)
    law = np.zeros((2, 8))
    law[:, 2:4] = slopes(lambda paid: wall_currents(paid, stiffness, rest), at[2:4])
    both = expm(TICK_S * np.block([[a, b], [np.zeros((2, 10))]]))
    ad, bd = both[:8, :8], both[:8, 8:]
    loop = np.block([[ad, bd], [law, np.zeros((2, 2))]]) if delay else ad + bd @ law
    return float(np.abs(np.linalg.eigvals(loop)).max())


def limit(delay: int) -> float:
    """The stiffness at which the loop's largest eigenvalue has size 1."""
    low, high = 1.0, 10.0
    assert radius(low, delay) < 1 < radius(high, delay)
    for _ in range(10):
        middle = (low + high) / 2
        low, high = (middle, high) if radius(middle, delay) < 1 else (low, middle)
    return (low + high) / 2


def swings(stiffness: float, delay: int) -> tuple[float, float]:
    """How far the tool swings about its balance at first, and at last, under the firmware's law."""
    one = Mechanics(**STILL, tool_n_s_per_mm=DAMPING)
    s, at = one.state, balance(one, stiffness)
    s.x_mm, s.z_mm, s.paid_mm[LEFT], s.paid_mm[RIGHT] = at[:4]
    s.vz_mm_s = 0.5
    length, tension = one.ffi.new("double[2]"), one.ffi.new("double[2]")
    x, z = one.ffi.new("double *"), one.ffi.new("double *")
    waiting, heights = [], []
    for _ in range(8000):
        length[LEFT], length[RIGHT] = (s.rest_mm[n] + s.paid_mm[n] for n in (LEFT, RIGHT))
        one.lib.tq_cables_place(one.cables, length, x, z)
        force = stiffness * max(0.0, -50 - z[0])
        one.lib.tq_cables_tensions(one.cables, length, x[0], z[0], force, tension)
        waiting.append((tension[LEFT] / 2.73, tension[RIGHT] / 2.73))
        one.tick(waiting[-1 - delay if len(waiting) > delay else -1], (0.0, -LOAD_N))
        heights.append(s.z_mm)
    return float(np.ptp(heights[:1000])), float(np.ptp(heights[-1000:]))


@pytest.mark.parametrize("delay", [0, 1])
def test_the_wall_on_a_free_tool_is_stable_up_to_its_exact_limit(delay: int) -> None:
    """0.8 and 1.2 of the limit of the sampled loop's eigenvalues, not of the passivity bound.

    With the usual cables a mass is stable a little beyond b/(T/2 + t_d).
    """
    bound, exact = DAMPING / (TICK_S / 2 + delay * TICK_S), limit(delay)
    print(f"\ndelay {delay}: passive up to {bound:.3f}, stable up to {exact:.3f} N/mm")
    assert bound < exact < 1.5 * bound
    first, last = swings(0.8 * exact, delay)
    assert last < 0.5 * first
    first, last = swings(1.2 * exact, delay)
    assert last > 10 * first


def test_within_the_passivity_bound_rotors_swing_on_cables_that_hardly_damp() -> None:
    """b acts on the tool; a rotor has the damping of its cable only, 2 c (z/l)² along z."""
    bound, up = DAMPING / (1.5 * TICK_S), 50 / np.hypot(300, 50)
    for c in (0.003, 0.005):
        own = 2 * c * up**2 / (1.5 * TICK_S)
        assert own < bound
        assert radius(0.8 * own, 1, cable_n_s_per_mm=c) < 1 < radius(bound, 1, cable_n_s_per_mm=c)
