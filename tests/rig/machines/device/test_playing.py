"""What the device plays: fades, sums over it, what is corrected, and times that the host sets."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal

from tactileq.modeling import Vibrator
from tactileq.modeling.vibrators.exposure import hand_arm_sections
from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.device.models import DEVICE_LIMITS, device_model
from tactileq.rig.machines.device.registers import (
    DeviceCommand,
    DeviceSource,
    DeviceState,
    DeviceStatus,
)
from tactileq.rig.shared.wire.conversation import DeviceRefused
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.rig.machines.device.talking import Talk, joined
from tests.rig.machines.device.test_models import HELLO

SAMPLES = 25
FADED_TICKS = 100  # 20 ms
CANVAS = device_model(planted_texture("canvas"), HELLO)


def playing(talk: Talk, samples: np.ndarray) -> np.ndarray:
    """The records of samples that the host sends, and of 50 ms after them."""
    parts = list(samples.reshape(-1, SAMPLES).tolist())
    for part in parts[:4]:
        talk.write("Samples", tuple(part))
    talk.write("EventRate", TICK_HZ)
    talk.write("Source", DeviceSource.HOST)
    blocks = talk.blocks()
    for part in parts[4:]:
        while talk.number("SamplesQueued") > 400:
            blocks += talk.blocks()
        talk.write("Samples", tuple(part))
    while talk.number("SamplesQueued"):
        blocks += talk.blocks()
    talk.write("Source", DeviceSource.NOTHING)
    blocks += talk.listened(0.05)
    return joined(blocks)["vibration_g"].astype(np.float64)


def with_weighting(resonance: Vibrator | None = None) -> Talk:
    """A device that weights, at one record a tick."""
    talk = Talk()
    sections = hand_arm_sections(TICK_HZ, vibrator=resonance).ravel()
    talk.write("Weighting", tuple(np.pad(sections, (0, 20 - sections.size)).tolist()))
    return talk


@pytest.mark.parametrize("hz", [40.0, 160.0, 800.0])
def test_sums_over_a_tone_are_those_of_the_closed_form(hz: float) -> None:
    """Of a sine: half its squared amplitude, and W_h's squared gain times that."""
    ramped = 0.3 * scipy.signal.windows.tukey(2 * TICK_HZ, alpha=0.4)
    tone = ramped * np.sin(2 * np.pi * hz * np.arange(ramped.size) / TICK_HZ)
    talk = with_weighting()
    played = playing(talk, tone.astype(np.float32))
    _, squares, weighted, peak, clipped, missed = talk.read("Played")  # type: ignore[misc]
    assert 1e-6 * squares == pytest.approx(float((ramped**2).sum()) / 2, rel=1e-4)
    b_a = np.insert(hand_arm_sections(TICK_HZ), 3, 1.0, axis=1)
    _, response = scipy.signal.sosfreqz(b_a, worN=[hz], fs=TICK_HZ)
    assert weighted / squares == pytest.approx(float(np.abs(response[0]) ** 2), rel=0.01)
    assert peak == pytest.approx(1e6 * np.abs(played).max(), rel=1e-5)
    assert clipped == 0
    assert missed <= SAMPLES  # between the last sample and the word that it was


def test_sums_over_a_texture_are_those_of_its_records() -> None:
    """Unweighted to rounding, weighted as SciPy filters the records in double precision."""
    talk = with_weighting(resonance := planted_vibrator())
    talk.push()
    talk.upload(CANVAS.data, CANVAS.hash)
    blocks = talk.recorded(1.5, source=DeviceSource.MODEL)
    talk.write("Source", DeviceSource.NOTHING)
    blocks += talk.listened(0.05)
    values = joined(blocks)["vibration_g"].astype(np.float64)
    ticks, squares, weighted, *_ = talk.read("Played")  # type: ignore[misc]
    assert abs(ticks - 1.5 * TICK_HZ) < FADED_TICKS
    assert 1e-6 * squares == pytest.approx(float((values**2).sum()), rel=1e-3)
    sections = np.insert(hand_arm_sections(TICK_HZ, vibrator=resonance), 3, 1.0, axis=1)
    filtered = scipy.signal.sosfilt(sections, values)
    assert 1e-6 * weighted == pytest.approx(float((filtered**2).sum()), rel=5e-3)


@pytest.mark.parametrize(
    ("section", "stable"),
    [
        ((1, 0, 0, -1.9, 0.95), True),
        ((1, 0, 0, 0, 1.0), False),
        ((1, 0, 0, -1.96, 0.95), False),
        ((1, 0, 0, 1.96, 0.95), False),
    ],
)
def test_a_weighting_that_rings_on_is_refused(section: tuple[float, ...], stable: bool) -> None:
    """Jury's criterion: |a2| < 1 and |a1| < 1 + a2."""
    talk = Talk()
    value = (*section, *(0.0,) * 15)
    if stable:
        talk.write("Weighting", value)
        return
    with pytest.raises(DeviceRefused) as told:
        talk.write("Weighting", value)
    assert told.value.status == DeviceStatus.RANGE


def largest_step(values: np.ndarray) -> float:
    return float(np.abs(np.diff(values)).max())


def test_a_model_fades_out_when_it_is_no_longer_the_source_and_then_rests() -> None:
    talk = Talk()
    talk.push()
    talk.upload(CANVAS.data, CANVAS.hash)
    before = joined(talk.recorded(1.0, source=DeviceSource.MODEL))["vibration_g"]
    talk.blocks()
    after = joined(talk.recorded(0.4))["vibration_g"]  # Source NOTHING
    assert np.abs(before[-500:]).max() > 0.05
    assert not after[FADED_TICKS:].any()
    assert largest_step(np.concatenate([before[-1:], after])) <= largest_step(before)
    played = talk.number("Played")[:3]
    talk.run(0.5)
    assert talk.number("Played")[:3] == played


def test_samples_that_end_in_their_midst_are_not_cut_off() -> None:
    talk = Talk()
    played = playing(talk, np.full(500, 0.5, dtype=np.float32))
    assert largest_step(played[played.argmax() :]) <= 0.1 * 0.5 + 1e-6
    assert played[-1] == 0


def test_a_model_that_nobody_hears_takes_its_place_at_once() -> None:
    """Two uploads while nothing is the source: a host that was killed may leave one behind."""
    talk = Talk()
    models = [device_model(planted_texture(name), HELLO) for name in ("canvas", "MDF", "PVC")]
    for model in models:
        talk.upload(model.data, model.hash)
    talk.run(0.05)
    assert talk.number("ModelHash") == models[-1].hash


def test_corrections_are_those_of_the_kernel() -> None:
    """A limit of peak below the texture's; the hand is slower than the grid at its turns."""
    low = DEVICE_LIMITS.__class__(peak=0.05, rms=2.0, duration_s=60.0, pause_s=0.1)
    model = device_model(planted_texture("canvas"), HELLO, limits=low)
    talk = Talk()
    talk.push()
    talk.upload(model.data, model.hash)
    blocks = talk.recorded(2.0, source=DeviceSource.MODEL)
    values = joined(blocks)["vibration_g"]
    *_, clamped, peak, rms, duration = talk.read("Corrections")  # type: ignore[misc]
    assert np.abs(values).max() == pytest.approx(0.05)
    at_limit = int(np.count_nonzero(np.abs(values) > 0.05 * (1 - 1e-6)))
    assert abs(peak - at_limit) <= 5
    assert (clamped, rms, duration) == (0, 0, 0)


def test_the_converter_is_given_its_own_unit() -> None:
    talk = Talk()
    talk.write("VibrationScale", 2.5)
    talk.write("Samples", (0.2,) * SAMPLES)
    talk.write("Source", DeviceSource.HOST)
    assert talk.number("Vibration") == pytest.approx(0.2)
    assert talk.wire.board.given(2) == pytest.approx(0.5)


@pytest.mark.parametrize("seconds", [0.005, 0.1])
def test_the_ramp_takes_as_long_as_it_was_told_to(seconds: float) -> None:
    talk = Talk()
    talk.write("ReleaseTime", seconds)
    talk.push()
    talk.ask(DeviceCommand.STOP)
    talk.wire.step(round(2 * seconds * TICK_HZ))
    assert talk.state == DeviceState.FAULT
    took = talk.number("ZeroTick") - talk.number("FaultTick")
    assert abs(took - seconds * TICK_HZ) <= 1


@pytest.mark.parametrize("delay_ms", [1, 10, 32])
def test_the_speed_is_late_by_the_delay_that_was_set(delay_ms: int) -> None:
    """A stroke is a sinusoid of 0.5 Hz, whose speed is late by its phase."""
    talk = Talk()
    talk.write("SpeedDelay", delay_ms)
    talk.push()
    talk.run(2.0)
    values = joined(talk.recorded(6.0))
    turn = np.exp(-2j * np.pi * 0.5 * np.arange(values.size) / TICK_HZ)
    whole = 2 * 2 * TICK_HZ  # two strokes
    position, speed = (
        np.sum(values[name][:whole] * turn[:whole]) for name in ("x_mm", "speed_mm_s")
    )
    phase = np.angle(speed / (position * 2j * np.pi * 0.5))
    held_s = 0.4e-3  # a speed counts until the next one, 1 ms later
    assert -phase / (2 * np.pi * 0.5) == pytest.approx(1e-3 * delay_ms + held_s, abs=2e-4)
