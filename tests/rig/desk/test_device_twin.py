"""The cable device in a twin's place: hands move against its wall, faults are never silent.

Everything here is simulated.
"""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import InputError, Renderer
from tactileq.modeling.hand import Hand
from tactileq.rig.desk.device_twin import LOOK_S, WALL, DeviceTwin
from tactileq.rig.machines.device.registers import DeviceSimulation
from tactileq.rig.shared.interface import SURFACES, HandRows, ToneBurst
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

LEATHER = planted_texture("leather")
VIRTUAL, REAL = SURFACES.index("virtual"), SURFACES.index("real")


def of(rows: HandRows, number: int) -> np.ndarray:
    """Which rows belong to a presentation."""
    return rows.presentation == number


def test_the_wall_decides_the_force_and_the_real_surface_lies_below(tmp_path) -> None:
    rig = DeviceTwin(seed=3)
    rig.open()
    rig.present_model(LEATHER)
    rig.present_real("leather")
    rig.present_model(LEATHER)
    rig.silence()
    assert rig.take_faults() == ()
    rows, records = rig.take_history(), rig.take_presentations()
    assert [record.surface for record in records] == ["virtual", "real", "virtual"]
    for number in (1, 3):
        own = of(rows, number)
        touching = own & (rows.force_n > 0.3)
        assert touching.sum() > 0.3 * own.sum()
        # A spring wall, seen through tracking and ramps.
        ratio = rows.force_n[touching] / rows.depth_mm[touching]
        assert np.median(ratio) == pytest.approx(WALL.stiffness_n_per_mm, rel=0.02)
        assert np.ptp(rows.x_mm[own]) > 40
        assert np.abs(rows.speed_mm_s[own]).max() > 80
        assert set(rows.surface[own]) == {VIRTUAL}
    real = of(rows, 2)
    assert set(rows.surface[real]) == {REAL}
    assert rows.depth_mm[real].min() > 79  # 80 mm below, on springs
    assert rows.depth_mm[real].max() == pytest.approx(81, abs=2)
    assert np.isnan(rows.force_n[real]).all()  # no wall is shown there, nothing measures it
    for record in records:
        times = rows.time_s[of(rows, record.number)]
        assert record.start_s <= times[0] < record.start_s + 0.006
        assert record.end_s - 0.006 <= times[-1] < record.end_s
        assert record.end_s - record.start_s >= LOOK_S - 0.05
    assert np.diff(rows.time_s).min() > 0
    assert 1 / np.median(np.diff(rows.time_s)) >= 200 - 1e-6


def test_the_device_plays_what_the_model_says_under_this_hand() -> None:
    """Its own sums against the renderer of the host, with the same speed and force; other noise."""
    rig = DeviceTwin(seed=5, look_s=8.0)
    rig.open()
    rig.present_model(LEATHER)
    rig.silence()
    (record,), rows = rig.take_presentations(), rig.take_history()
    assert record.counters.lift_offs == record.counters.limited_peak == 0
    own = of(rows, 1)
    moments = np.arange(rows.time_s[own][0], rows.time_s[own][-1], 1 / LEATHER.rate_hz)
    speed, force = (
        np.interp(moments, rows.time_s[own], values[own])
        for values in (rows.speed_mm_s, rows.force_n)
    )
    rendered = Renderer(LEATHER, seed=1).render(*Hand(speed, force))
    assert record.played_s == pytest.approx(8.0, abs=0.1)
    assert record.rms_g == pytest.approx(np.sqrt(np.mean(rendered**2)), rel=0.15)


def test_each_hand_has_its_stroke_and_a_seed_its_hands() -> None:
    found = []
    for seed in (1, 1, 2):
        rig = DeviceTwin(seed=seed, look_s=1.2)
        for _ in range(2):
            rig.open()
            rig.present_model(LEATHER)
            rig.silence()
            found.append(rig.take_history())
    ways = [round(float(np.ptp(rows.x_mm[rows.force_n > 0])), 3) for rows in found]
    assert ways[:2] == ways[2:4]
    assert len(set(ways)) == 4


@pytest.mark.parametrize(
    ("what", "cause"),
    [
        (
            DeviceSimulation.SLACK,
            "let go",
        ),  # by its slackness, or faster where more force was on it
        (DeviceSimulation.STUCK, "encoder"),
        (DeviceSimulation.JUMP, "moved further"),
        (DeviceSimulation.MOTOR, "did not take"),
        (DeviceSimulation.UNPLUGGED, ""),
    ],
)
def test_what_goes_wrong_is_a_fault_and_nothing_goes_on_silently(
    what: DeviceSimulation, cause: str
) -> None:
    rig = DeviceTwin(seed=3)
    rig.open()
    rig.present_model(LEATHER)
    for _ in range(100):
        rig.read()
    rig.spoil(what)
    rig.silence()
    (fault,) = rig.take_faults()
    assert fault.invalidates
    assert cause in fault.sentence
    before = rig.take_presentations()[0]
    assert 0.8 < before.played_s < 1.2  # until it let go
    rig.take_history()
    rig.present_model(LEATHER)  # until people have armed it anew, nothing pushes
    rig.silence()
    assert rig.take_faults()[0].invalidates
    assert rig.take_presentations()[0].dose_g2_s == 0
    assert not (rig.take_history().force_n > 0).any()


def test_signals_are_refused() -> None:
    rig = DeviceTwin()
    burst = ToneBurst(frequency_hz=100.0, amplitude_g=0.1, duration_s=0.5)
    with refused(InputError, expected="model", got="signal"):
        rig.present_signal(burst)


def test_once_mended_and_armed_it_goes_on() -> None:
    rig = DeviceTwin(seed=3)
    rig.open()
    rig.present_model(LEATHER)
    rig.spoil(DeviceSimulation.JUMP)
    rig.silence()
    assert rig.take_faults()
    rig.open()
    rig.present_model(LEATHER)
    rig.silence()
    assert rig.take_faults() == ()
    assert (rig.take_history().force_n > 0.3).any()
