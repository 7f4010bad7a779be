"""The rig in silico: what it reports and what its hand feels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactileq.modeling import InputError, Renderer, regressed
from tactileq.modeling.models.loading import Layered
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.rig.devices.sound.signals import tone_burst
from tactileq.rig.shared.interface import SURFACES, RigReading, TextureRig, ToneBurst
from tests.refusals import refused
from tests.rig.planted import planted_model as model
from tests.rig.planted import planted_stimulus

STEP_S = 0.01


def hand(moments_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The documented stroke: to and fro, 1 Hz, up to 250 mm/s, 1 to 2 N."""
    return 250 * np.sin(2 * np.pi * moments_s), 1.5 + 0.5 * np.cos(2 * np.pi * moments_s)


def feel(rig: SimulatedRig, readings: int) -> np.ndarray:
    felt = []
    for _ in range(readings):
        rig.read()
        felt.append(rig.last_vibration)
    return np.concatenate(felt)


def test_it_is_a_rig_and_says_it_is_simulated() -> None:
    rig: TextureRig = SimulatedRig()
    assert rig.simulated
    reading = rig.read()
    assert isinstance(reading, RigReading)
    assert reading.simulated


def test_readings_follow_the_stroke_in_the_rigs_own_time() -> None:
    rig = SimulatedRig()
    readings = [rig.read() for _ in range(250)]
    moments = STEP_S * np.arange(1, 251)
    assert [r.time_s for r in readings] == pytest.approx(moments)
    speed, force = hand(moments)
    assert [r.speed_mm_s for r in readings] == pytest.approx(np.abs(speed), abs=1e-9)
    assert [r.force_n for r in readings] == pytest.approx(force, abs=1e-9)
    assert all(r.speed_mm_s >= 0 and 1 <= r.force_n <= 2 for r in readings)
    assert all(r.simulated for r in readings)


def test_button_is_reported_once() -> None:
    rig = SimulatedRig()
    assert not rig.read().button
    rig.press_button()
    assert [rig.read().button for _ in range(3)] == [True, False, False]
    rig.press_button()
    rig.press_button()
    assert [rig.read().button for _ in range(2)] == [True, False]


def test_nothing_is_felt_before_and_after_presenting() -> None:
    rig = SimulatedRig()
    assert feel(rig, 3).size == 0
    rig.present_model(model())
    assert feel(rig, 3).size == 150
    rig.silence()
    assert feel(rig, 3).size == 0


@pytest.mark.parametrize("presented", [model(), regressed(model())], ids=["grid", "regressed"])
def test_felt_vibration_is_the_renderers(presented: Layered) -> None:
    rig = SimulatedRig(seed=11)
    feel(rig, 13)  # presenting may begin anywhere in the stroke
    rig.present_model(presented)
    felt = feel(rig, 60)
    moments = 13 * STEP_S + np.arange(1, 3001) / 5000
    expected = Renderer(presented, seed=11, stream=1).render(*hand(moments))
    assert felt == pytest.approx(expected, abs=1e-9)
    assert np.std(felt) > 0.005


def test_each_presentation_has_fresh_noise() -> None:
    rig = SimulatedRig(seed=2)
    felt = []
    for _ in range(2):
        rig.present_model(model())
        felt.append(feel(rig, 100))  # one whole stroke each
    assert not np.array_equal(*felt)
    assert abs(np.corrcoef(*felt)[0, 1]) < 0.2


def test_same_seed_same_feeling() -> None:
    def run(seed: int) -> np.ndarray:
        rig = SimulatedRig(seed=seed)
        rig.present_model(model())
        return feel(rig, 20)

    assert np.array_equal(run(5), run(5))
    assert not np.array_equal(run(5), run(6))


def test_model_rates_other_than_5_khz() -> None:
    rig = SimulatedRig()
    rig.present_model(model(rate_hz=2000.0))
    assert feel(rig, 5).size == 100


def test_real_surfaces_are_the_truth_that_was_given() -> None:
    rig = SimulatedRig({"felt": model(0.3)}, seed=3)
    rig.present_real("felt")
    expected = Renderer(model(0.3), seed=3, stream=1).render(*hand(np.arange(1, 501) / 5000))
    assert feel(rig, 10) == pytest.approx(expected, abs=1e-9)
    with refused(InputError, expected="felt", got="'silk'"):
        rig.present_real("silk")


def test_without_truth_real_surfaces_are_still() -> None:
    rig = SimulatedRig()
    rig.present_model(model())
    rig.present_real("felt")
    assert feel(rig, 3).size == 0


def test_its_history_has_500_rows_a_second_and_says_what_was_presented() -> None:
    rig = SimulatedRig({"felt": model()})
    rig.open()
    rig.read()
    rig.present_real("felt")
    rig.read()
    rig.present_model(model())
    rig.read()
    rows = rig.take_history()
    assert rows.time_s == pytest.approx(0.002 * np.arange(1, 16))
    speed, force = hand(rows.time_s)
    assert rows.speed_mm_s == pytest.approx(speed)  # with its sign
    assert rows.force_n == pytest.approx(force)
    assert [SURFACES[k] for k in rows.surface] == ["none"] * 5 + ["real"] * 5 + ["virtual"] * 5
    assert rows.presentation.tolist() == [0] * 5 + [1] * 5 + [2] * 5
    assert not rows.force_assumed.any()
    assert len(rig.take_history()) == 0


def test_presentations_are_told_once_they_end_with_times_dose_and_counters() -> None:
    rig = SimulatedRig(seed=4)
    rig.open()
    feel(rig, 2)
    shown = model()
    start_s = rig.present_model(shown)
    felt = feel(rig, 50)
    assert rig.take_presentations() == ()
    rig.present_real("felt")
    rig.read()
    rig.silence()
    virtual, real = rig.take_presentations()
    assert (virtual.number, virtual.surface, virtual.texture) == (1, "virtual", "planted")
    assert (virtual.start_s, virtual.end_s) == (start_s, pytest.approx(0.52))
    assert virtual.model_sha256 == shown.sha256
    assert (virtual.speeds_mm_s, virtual.forces_n) == ((50.0, 350.0), (0.5, 3.5))
    assert virtual.dose_g2_s == pytest.approx(np.sum(felt**2) / 5000)
    assert virtual.rms_g == pytest.approx(np.sqrt(np.mean(felt**2)))
    assert virtual.peak_g == pytest.approx(np.abs(felt).max())
    speed, _ = hand(0.02 + np.arange(1, 2501) / 5000)
    slow = np.count_nonzero(np.abs(speed) < 50)
    assert virtual.counters.below_grid == pytest.approx(slow, abs=20)
    assert (real.number, real.surface, real.texture) == (2, "real", "felt")
    assert (real.dose_g2_s, real.rms_g, real.model_sha256) == (0.0, 0.0, "")
    assert rig.take_presentations() == ()


def test_a_fault_is_told_once_and_opening_forgets_what_was_before() -> None:
    rig = SimulatedRig()
    rig.present_model(model())
    rig.read()
    rig.break_down("expected a vibrator, got none; plug it in.")
    (fault,) = rig.take_faults()
    assert (fault.time_s, fault.invalidates) == (rig.now_s(), True)
    assert rig.take_faults() == ()
    rig.open()
    assert (len(rig.take_history()), rig.take_presentations()) == (0, ())
    assert rig.now_s() == 0.0
    rig.present_model(model())
    rig.read()
    rig.silence()
    (record,) = rig.take_presentations()
    assert (record.number, record.start_s, rig.read().time_s) == (1, 0.0, 2 * STEP_S)


def test_a_burst_is_felt_once_to_its_end_whatever_the_hand_does() -> None:
    rig = SimulatedRig()
    rig.open()
    rig.press_button()
    burst = ToneBurst(frequency_hz=50.0, amplitude_g=0.2, duration_s=0.505)
    assert rig.present_signal(burst) == 0.0
    assert rig.now_s() == pytest.approx(0.51)  # ends within a step
    assert feel(rig, 3).size == 0
    rig.silence()
    (record,) = rig.take_presentations()
    assert (record.surface, record.texture, record.model_sha256) == ("virtual", "50 Hz", "")
    assert record.speeds_mm_s is None  # no grid: nobody strokes outside of it
    expected = tone_burst(50.0, 0.2, duration_s=0.505, rate_hz=5000.0).samples_g
    assert record.peak_g == np.abs(expected).max() == pytest.approx(0.2)
    assert record.played_s == pytest.approx(0.505)
    assert record.dose_g2_s == pytest.approx(float(expected @ expected) / 5000.0)


def test_a_press_during_a_burst_is_reported_after_it() -> None:
    rig = SimulatedRig()
    rig.press_button()
    rig.present_signal(ToneBurst(frequency_hz=50.0, amplitude_g=0.0, duration_s=0.1))
    assert [rig.read().button for _ in range(2)] == [True, False]


def test_a_burst_beyond_its_highest_amplitude_is_refused() -> None:
    rig = SimulatedRig()
    burst = ToneBurst(frequency_hz=50.0, amplitude_g=1.0, duration_s=0.1)
    highest_g = rig.strongest_g(burst)
    rig.present_signal(replace(burst, amplitude_g=highest_g))
    with refused(InputError, expected="5 g", got="5.01 g"):
        rig.present_signal(replace(burst, amplitude_g=highest_g + 0.01))


def test_a_stimulus_is_felt_as_time_goes_on_and_from_its_beginning_each_time() -> None:
    rig = SimulatedRig()
    rig.open()
    samples = 0.1 + 0.001 * np.arange(100.0)
    stimulus = planted_stimulus(samples, rate_hz=4000.0)
    rig.present_signal(stimulus)
    felt = [feel(rig, 1) for _ in range(4)]
    np.testing.assert_array_equal(np.concatenate(felt), samples)
    assert [part.size for part in felt] == [40, 40, 20, 0]
    rig.present_signal(stimulus)
    np.testing.assert_array_equal(feel(rig, 1), samples[:40])
    rig.present_real("PVC")
    assert feel(rig, 1).size == 0
    rig.silence()
    whole, broken_off, _ = rig.take_presentations()
    assert (whole.model_sha256, whole.texture, whole.speeds_mm_s) == ("a" * 64, "PVC", None)
    assert whole.dose_g2_s == pytest.approx(float(samples @ samples) / 4000)
    assert whole.played_s == pytest.approx(0.025)
    assert broken_off.played_s == pytest.approx(0.01)


def test_a_stimulus_that_this_rig_cannot_present_is_refused() -> None:
    rig = SimulatedRig()
    stimulus = planted_stimulus(np.full(10, 5.01), rate_hz=4000.0)
    with refused(InputError, expected="5 g", got="5.01 g"):
        rig.present_signal(stimulus)
    driven = replace(stimulus, samples_g=np.zeros(10), vibrator_sha256="c" * 64)
    with refused(InputError, expected="compensation", got="PVC"):
        rig.check_stimulus(driven)
