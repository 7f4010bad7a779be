"""The rig in silico: what it reports and what its hand feels."""

from __future__ import annotations

import numpy as np
import pytest

from modeling import InputError, Renderer, TextureModel, regressed
from modeling.models.loading import Layered
from rig.interface import RigReading, TextureRig
from rig.twin import SimulatedRig

STEP_S = 0.01


def model(gain: float = 0.2, *, rate_hz: float = 5000.0) -> TextureModel:
    return TextureModel(
        texture="planted",
        rate_hz=rate_hz,
        speeds_mm_s=[50.0, 350.0],
        forces_n=[0.5, 3.5],
        noise_gains=[[0.01, 0.02], [0.03, 0.05]],
        frequencies_hz=np.array([60.0, 70.0, 300.0, 320.0]).reshape(2, 2, 1),
        bandwidths_hz=np.full((2, 2, 1), 30.0),
        gains=np.full((2, 2, 1), gain),
        level_sd_db=np.zeros((2, 2, 1)),
        estimator="planted",
        simulated=True,
    )


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
    with pytest.raises(InputError, match="among felt, got 'silk'"):
        rig.present_real("silk")


def test_without_truth_real_surfaces_are_still() -> None:
    rig = SimulatedRig()
    rig.present_model(model())
    rig.present_real("felt")
    assert feel(rig, 3).size == 0
