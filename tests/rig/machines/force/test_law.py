"""Wall, limits and states of a force device, in virtual time (rig/machines/force/force.h)."""

from __future__ import annotations

import subprocess
from itertools import product
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tactileq.rig.machines.force
from tactileq.rig.devices.hand.tracking import TrackingFilter
from tactileq.rig.machines.force.settings import ForceSettings, Pose
from tactileq.rig.machines.force.states import SENTENCES, Cause, ForceEvent, State
from tactileq.rig.machines.force.wall import Wall, largest_stiffness_n_per_mm
from tactileq.rig.shared.live.compiled import compiled
from tests.rig.machines.force.law import TICK_S, WALL, Law

HEADERS = Path(tactileq.rig.machines.force.__file__).parent
# State and event → state; every other event leaves a state as it is (docs/force-device.md#states).
TABLE = {
    (State.BOOT, ForceEvent.SENSED): State.IDLE,
    (State.BOOT, ForceEvent.FAILED): State.FAULT,
    (State.IDLE, ForceEvent.ARM): State.ARMED,
    (State.IDLE, ForceEvent.FAILED): State.FAULT,
    (State.ARMED, ForceEvent.SHOW): State.RUNNING,
    (State.ARMED, ForceEvent.FAILED): State.RELEASING,
    (State.RUNNING, ForceEvent.HIDE): State.ARMED,
    (State.RUNNING, ForceEvent.FAILED): State.RELEASING,
    (State.RELEASING, ForceEvent.ZERO): State.FAULT,
    (State.FAULT, ForceEvent.CLEAR): State.BOOT,
}


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """tests/rig/machines/force/walks.c, compiled."""
    made = tmp_path_factory.mktemp("walks") / "walks"
    source = Path(__file__).with_name("walks.c")
    options = ["-std=gnu99", "-O2", "-Wall", "-Wextra", "-Werror", f"-I{HEADERS}"]
    checked = ["-fsanitize=undefined", "-fno-sanitize-recover=all"]
    subprocess.run(["gcc", *options, *checked, str(source), "-o", str(made), "-lm"], check=True)
    return made


def walks(program: Path, *words: object) -> dict[str, float]:
    """What it prints, by name."""
    found = subprocess.run(
        [str(program), *map(str, words)], check=True, capture_output=True, text=True
    ).stdout.split()
    return {name: float(value) for name, value in zip(found[::2], found[1::2], strict=True)}


def test_every_pair_of_state_and_event_leads_where_the_table_says() -> None:
    lib = compiled().lib
    assert (len(State), len(ForceEvent), len(Cause)) == (
        lib.TQ_STATES,
        lib.TQ_EVENTS,
        lib.TQ_CAUSES,
    )
    for state, event in product(State, ForceEvent):
        assert lib.tq_force_next(state, event) == TABLE.get((state, event), state), (state, event)


def test_nothing_reaches_running_but_arm_and_then_show() -> None:
    # From FAULT, over all sequences of six events: RUNNING only where CLEAR, a reading, ARM and
    # SHOW stand among them in this order.
    lib = compiled().lib
    needed = (ForceEvent.CLEAR, ForceEvent.SENSED, ForceEvent.ARM, ForceEvent.SHOW)
    ways = 0
    for events in product(ForceEvent, repeat=6):
        state = int(State.FAULT)
        for event in events:
            state = lib.tq_force_next(state, event)
        if state == State.RUNNING:
            left = iter(events)
            assert all(event in left for event in needed), events
            ways += 1
    assert ways > 0


@pytest.mark.long("sweeps: ten million steps")
def test_a_random_walk_of_ten_million_faulty_steps_breaks_no_limit(program: Path) -> None:
    found = walks(program, "faults", 1, 10_000_000)
    assert found["broken"] == 0
    assert found["largest"] == pytest.approx(5.0)  # the limit was reached
    assert found["longest"] <= ForceSettings().release_s + 0.004
    assert found["causes"] == len(Cause) - 1  # all of them happened
    assert found["running"] > 1_000_000


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_a_wall_generates_energy_beyond_the_bound_and_none_within(
    program: Path, delay: int
) -> None:
    for damper in (0.0, 0.3):
        assert walks(program, "strokes", 3, 1000, 1.0, delay, damper)["positive"] == 0
    assert walks(program, "strokes", 3, 1000, 2.0, delay, 0.0)["positive"] > 950


@pytest.mark.parametrize("delay", [0, 1])
def test_a_mass_comes_to_rest_below_the_bound_and_never_above(program: Path, delay: int) -> None:
    assert walks(program, "mass", 0.8, delay)["worst"] < 0.01
    assert walks(program, "mass", 1.2, delay)["worst"] > 10


def test_periods_within_what_is_tolerated_let_a_mass_rest_and_others_let_go(program: Path) -> None:
    """At 0.8 of the bound; periods in ms, drawn evenly."""
    for least, most, late in ((1, 1, 4), (0.5, 1.4, 4), (1, 1.5, 4), (1.49, 1.49, 4), (1, 1.7, 15)):
        found = walks(program, "late", 0.8, least, most, late, 0.2)
        assert (found["cause"], found["last"] < 0.001) == (Cause.NONE, True), (least, most)
    for least, most, late in ((1, 4, 4), (1, 7, 15), (1, 15, 15), (1.6, 1.6, 4)):
        found = walks(program, "late", 0.8, least, most, late, 0.2)
        assert found["cause"] == Cause.SLOW
        assert found["worst"] < 0.05  # it had not begun to swing
    assert walks(program, "late", 1.4, 1.49, 1.49, 4, 0.2)["last"] > 0.02  # no wall may be stiffer


@pytest.mark.parametrize(("late", "gap"), [(4, 3), (4, 4), (15, 4), (15, 15), (19, 5)])
def test_late_periods_that_come_when_a_mass_is_fastest_let_it_rest(
    program: Path, late: float, gap: float
) -> None:
    for kg in (0.05, 0.1, 0.2):
        found = walks(program, "late", 0.8, 1, -gap, late, kg)
        assert (found["cause"], found["last"] < 0.001) == (Cause.NONE, True), kg
        assert found["mean"] > 0.0013  # as often as is tolerated


def test_tools_that_answer_a_small_force_the_wrong_way_are_never_armed(program: Path) -> None:
    """1000 tools, free and in hands that move, tremble and are soft or stiff."""
    assert walks(program, "probe", 7, 1000, 1)["armed"] > 980
    assert walks(program, "probe", 7, 1000, -1) == {"armed": 0, "unanswered": 1000}


def test_a_wall_that_was_asked_for_before_the_small_force_has_ended_comes_after_it() -> None:
    law = Law(ForceSettings(probe_n=1.0, frozen_s=9.0)).armed()
    law.event(ForceEvent.SHOW)
    answer = [0.5 * np.sin(2 * np.pi * 12.5 * n * TICK_S - 2.5) for n in range(402)]
    forces = [law.tick((0, 0, -1 + z)) for z in answer]
    assert min(forces[:390]) < -0.9  # around nothing: there is no wall yet
    assert law.state == State.RUNNING
    ramp = [law.tick((0, 0, -1.0)) for _ in range(250)]
    assert max(np.diff(ramp)) < 2 * 1.5 * TICK_S / ForceSettings().show_s
    assert ramp[-1] == pytest.approx(1.0)


def test_a_tool_that_stays_below_a_wall_at_its_limit_is_let_go() -> None:
    law = Law(ForceSettings(frozen_s=9.0)).running()
    law.to((0, 0, -4.9), ticks=1500)  # of 5 N at most
    assert law.state == State.RUNNING
    law.to((0, 0, -5.2), ticks=400)
    assert law.state == State.RUNNING
    law.to((0, 0, -5.2), ticks=800)
    assert law.cause == Cause.PRESSED_THROUGH


@settings(max_examples=60, deadline=None)
@given(
    rate_hz=st.floats(500, 4000),
    damping=st.floats(0.05, 5),
    periods=st.integers(0, 5),
    share=st.floats(0, 0.9),
)
def test_the_bound_is_that_of_the_frequency_domain(
    rate_hz: float, damping: float, periods: int, share: float
) -> None:
    wall_damping = share * damping
    largest = 1e3 * largest_stiffness_n_per_mm(
        rate_hz=rate_hz,
        damping_n_s_per_m=damping,
        delay_s=periods / rate_hz,
        wall_damping_n_s_per_m=wall_damping,
    )
    period = 1 / rate_hz
    angle = np.linspace(1e-4, np.pi, 20001)
    z = np.exp(-1j * angle)

    def needed(stiffness: float) -> float:
        held = z**periods * (stiffness + wall_damping * (1 - z) / period)
        return float(np.max(period / 2 / (1 - np.cos(angle)) * np.real((1 - z) * held)))

    assert needed(largest) <= damping * (1 + 1e-6)
    if wall_damping == 0:  # and no larger one is
        assert needed(1.01 * largest) > damping


def test_force_is_that_of_spring_and_damper() -> None:
    wall = Wall(stiffness_n_per_mm=0.5, damping_n_s_per_m=20.0, width_mm=80, length_mm=80)
    law = Law(ForceSettings(most_n=20), wall).running()
    assert law.to((0, 0, -4.0)) == pytest.approx(0.5 * 4)
    for n in range(300):  # 10 mm/s into it, for long enough that its low-pass has settled
        force = law.tick((0, 0, -4.0 - 0.01 * (n + 1)))
    assert force == pytest.approx(0.5 * 7 + 0.020 * 10, rel=1e-3)


def test_a_wall_never_pulls() -> None:
    wall = Wall(stiffness_n_per_mm=0.05, damping_n_s_per_m=50.0, width_mm=80, length_mm=80)
    law = Law(wall=wall).running()
    law.to((0, 0, -2.0))
    forces = [law.tick((0, 0, -2.0 + 0.2 * n)) for n in range(40)]
    assert min(forces) == 0
    assert forces[-1] == 0


def test_a_wall_that_is_switched_on_while_penetrated_comes_as_a_ramp() -> None:
    law = Law().armed()
    law.to((0, 0, -3.0))
    law.event(ForceEvent.SHOW)
    forces = [law.tick((0, 0, -3.0)) for _ in range(250)]
    assert max(np.diff([0, *forces])) == pytest.approx(3.0 * TICK_S / ForceSettings().show_s)
    assert forces[99] == pytest.approx(1.5)
    assert forces[-1] == pytest.approx(3.0)


def test_a_wall_that_is_switched_on_far_above_the_tool_waits_for_it_to_come_from_above() -> None:
    law = Law(ForceSettings(most_n=5.0)).armed()
    law.to((0, 0, -5.5))  # as on a real surface below: a spring of 1 N/mm would push with 5.5 N
    law.event(ForceEvent.SHOW)
    assert max(law.tick((0, 0, -5.5)) for _ in range(400)) == 0
    assert law.force.beyond
    law.to((0, 0, 1.0))
    assert law.to((0, 0, -2.0)) == pytest.approx(2.0)


def test_a_wall_that_is_switched_on_in_the_air_is_there_at_once() -> None:
    law = Law().running()
    law.tick((0, 0, 0.1))
    assert law.tick((0, 0, -0.5)) == pytest.approx(0.5)


def test_a_wall_that_is_hidden_ramps_out() -> None:
    law = Law(ForceSettings(frozen_s=5)).running()
    law.to((0, 0, -2.0))
    law.event(ForceEvent.HIDE)
    forces = [law.tick((0, 0, -2.0)) for _ in range(250)]
    assert law.state == State.ARMED
    assert np.all(np.diff(forces) <= 1e-12)
    assert forces[0] > 1.9
    assert forces[-1] == 0


def test_beyond_its_edge_a_wall_is_not_there_until_one_comes_back_from_above() -> None:
    law = Law(ForceSettings(most_n_per_s=1e5)).running()
    law.to((0, 0, -2.0))
    assert not law.force.beyond
    law.to((45, 0, -2.0))
    assert law.force.beyond
    assert law.force.normal_n == 0
    assert law.to((30, 0, -2.0)) == 0  # back from beside it: under the wall
    assert law.force.beyond
    law.to((30, 0, 0.5))
    assert law.to((30, 0, -2.0)) == pytest.approx(2.0)
    assert not law.force.beyond


def test_force_grows_no_faster_than_its_limit_and_power_stays_below_it() -> None:
    limits = ForceSettings(most_n=4.0, most_n_per_s=100.0, most_w=0.2)
    law = Law(limits, Wall(stiffness_n_per_mm=10, width_mm=80, length_mm=80)).running()
    before = 0.0
    for n in range(150):
        force = law.tick((0, 0, 1 - 0.3 * n))
        assert force - before <= 100.0 * TICK_S + 1e-12
        assert force * abs(law.force.velocity_mm_s[2]) <= 1e3 * 0.2 * (1 + 1e-12)
        before = force
    assert before == pytest.approx(0.2 / 0.3, rel=1e-3)  # 0.3 m/s
    assert law.to((0, 0, -43.8)) == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("cause", "reading"),
    [
        (Cause.NOT_READ, {"failed": True}),
        (Cause.NOT_A_NUMBER, {"position_mm": (0.0, nan, -2.0)}),
        (Cause.NOT_A_NUMBER, {"position_mm": (0.0, 0.0, -inf)}),
        (Cause.LATE, {"step_s": 0.0041}),
        (Cause.LATE, {"step_s": -0.001}),
        (Cause.LATE, {"step_s": nan}),
        (Cause.JUMP, {"position_mm": (50.0, 0.0, -2.0)}),
        (Cause.JUMP, {"position_mm": (0.0, 0.0, -5.1)}),
        (Cause.WORKSPACE, {"position_mm": (0.0, 0.0, -2.6)}),
    ],
)
def test_a_bad_reading_lets_go_as_a_ramp_and_stays_so(
    cause: Cause, reading: dict[str, object]
) -> None:
    law = Law(ForceSettings(low_mm=(-60, -60, -2.5))).running()
    assert law.to((0, 0, -2.0)) == pytest.approx(2.0)
    usual = {"position_mm": (0.0, 0.0, -2.0)}
    forces = [2.0, law.tick(**{**usual, **reading})]  # type: ignore[arg-type]
    assert law.cause == cause
    assert law.state == State.RELEASING
    forces += [law.tick((0, 0, -2.0)) for _ in range(60)]
    assert law.state == State.FAULT
    steps = -np.diff(forces)
    assert np.all(steps >= 0)
    # Linear, whatever time the bad reading itself is given: 50 ms of good ones at most.
    assert max(steps[1:]) == pytest.approx(2.0 * TICK_S / 0.05)
    assert forces[-1] == 0
    assert SENTENCES[law.cause]
    for event in (ForceEvent.ARM, ForceEvent.SHOW, ForceEvent.HIDE):
        law.event(event)
        assert law.tick((0, 0, -2.0)) == 0
        assert law.state == State.FAULT
    # Only CLEAR and ARM and SHOW bring it back, and then as a ramp.
    law.event(ForceEvent.CLEAR)
    law.tick((0, 0, -2.0))
    assert law.state == State.IDLE
    law.event(ForceEvent.ARM)
    law.event(ForceEvent.SHOW)
    assert law.tick((0, 0, -2.0)) == pytest.approx(2.0 * TICK_S / 0.2)


def test_a_tool_that_is_too_fast_is_let_go() -> None:
    law = Law(ForceSettings(most_mm_s=300)).running()
    law.to((-25, 0, 1))
    for n in range(100):
        law.tick((0.5 * n - 25, 0, 1))
    assert law.cause == Cause.SPEED


def test_a_frozen_reading_lets_go_under_force_only() -> None:
    law = Law(ForceSettings(frozen_s=0.1)).running()
    for _ in range(500):
        law.tick((0, 0, 1))
    assert law.state == State.RUNNING
    law.to((0, 0, -2.0), ticks=90)
    assert law.state == State.RUNNING
    for _ in range(20):
        law.tick((0, 0, -2.0))
    assert law.cause == Cause.FROZEN


def test_the_first_cause_is_kept() -> None:
    law = Law().running()
    law.to((0, 0, -2.0))
    law.event(ForceEvent.FAILED, Cause.SOUND)
    law.tick((0, nan, -2.0))
    assert law.cause == Cause.SOUND


unit = st.floats(-1, 1)


@settings(max_examples=60, deadline=None)
@given(
    axis=st.tuples(unit, unit, unit).filter(lambda v: sum(x * x for x in v) > 0.01),
    angle=st.floats(-3, 3),
    origin=st.tuples(*[st.floats(-20, 20)] * 3),
    at=st.tuples(st.floats(-30, 30), st.floats(-30, 30)),
    depth=st.floats(0.01, 3),
)
def test_the_wall_is_felt_in_its_own_frame(
    axis: tuple[float, float, float],
    angle: float,
    origin: tuple[float, float, float],
    at: tuple[float, float],
    depth: float,
) -> None:
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    pose = Pose(origin_mm=origin, x=tuple(turn[:, 0]), y=tuple(turn[:, 1]), z=tuple(turn[:, 2]))

    def device(*local: float) -> list[float]:
        return [float(value) for value in turn @ np.array(local) + np.array(origin)]

    law = Law(ForceSettings(pose=pose), WALL)
    law.tick(device(*at, 0.5))
    law.event(ForceEvent.ARM)
    law.event(ForceEvent.SHOW)
    law.to(device(*at, -depth))
    assert law.force.depth_mm == pytest.approx(depth, abs=1e-9)
    assert list(law.force.position_mm) == pytest.approx([*at, -depth], abs=1e-9)
    assert law.command_n == pytest.approx([float(v) for v in depth * turn[:, 2]], abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(
    delay_s=st.floats(0.002, 0.1),
    moves=st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=5, max_size=300),
    gap=st.integers(0, 300),
)
def test_the_speed_of_strokes_is_that_of_the_tracking_filter(
    delay_s: float, moves: list[tuple[float, float]], gap: int
) -> None:
    module = compiled()
    stroke = module.ffi.new("tq_stroke *")
    module.lib.tq_stroke_start(stroke, delay_s)
    reference = TrackingFilter(delay_s)
    x = y = time_s = 0.0
    for place, (dx, dy) in enumerate(moves):
        # Two positions are at least a fortieth of the window apart in the reference.
        time_s += max(TICK_S, 2 * delay_s / 40) + (0.2 if place == gap else 0.0)
        x, y = x + dx, y + dy
        found = module.lib.tq_stroke_speed(stroke, time_s, x, y)
        wanted = reference.update(time_s, x, y)
        assert abs(found) == pytest.approx(abs(wanted), rel=1e-6, abs=1e-6)
        if abs(wanted) > 1e-3:
            assert found * wanted > 0 or abs(found) < 1e-3


def test_the_headers_compile_without_a_warning_and_need_no_library_but_memory(
    tmp_path: Path,
) -> None:
    source = tmp_path / "law.c"
    source.write_text(
        '#include "force.h"\nvoid (*law)(tq_force *, const tq_sensed *, double);\n'
        "void begin(void) { law = tq_force_tick; }\n"
    )
    options = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    unused = "-Wno-unused-function"
    target = tmp_path / "law.o"
    command = ["gcc", "-c", *options, unused, f"-I{HEADERS}", str(source), "-o", str(target)]
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    symbols = subprocess.run(["nm", target], check=True, capture_output=True, text=True).stdout
    called = {line.split()[-1] for line in symbols.splitlines() if " U " in line}
    assert called <= {"memcpy", "memset", "_GLOBAL_OFFSET_TABLE_"}
