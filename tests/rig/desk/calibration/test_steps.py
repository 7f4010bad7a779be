"""Calibration on a calculated card: planted truth is found, and written into the rig file."""

from __future__ import annotations

import datetime
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.calibration import measuring
from tactileq.rig.desk.calibration.floor import no_contact_floor
from tactileq.rig.desk.calibration.latency import summary_of
from tactileq.rig.desk.calibration.level import level_of
from tactileq.rig.desk.calibration.measuring import Accelerometer, gaps
from tactileq.rig.desk.calibration.opening import accelerometer_input, pressure_reader
from tactileq.rig.desk.calibration.steps import (
    check_softly,
    floor_figures,
    latency_figures,
    level_figures,
    mean_pressure,
    measure_gain,
    measure_vibrator,
    pressure_figures,
    save_vibrator,
)
from tactileq.rig.desk.calibration.trials import checked_loop_back_s, loop_back_s
from tactileq.rig.devices.hand.pressure import fit_pressure
from tactileq.rig.devices.simulated.vibrator import SimulatedTransducers
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import RigFile
from tests.refusals import refused
from tests.rig.desk.calibration.card import RATE_HZ, CalculatedCard, rig_file

TODAY = datetime.date(2026, 11, 22)
TRUTH = SimulatedTransducers(frequency_hz=150.0, bandwidth_hz=40.0, height=3.0, g_per_fullscale=5.0)


@pytest.fixture(autouse=True)
def no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measuring, "AROUND_S", 0.0)


def test_the_vibrator_is_identified_per_volt(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    card = CalculatedCard(rig, TRUTH)
    found = measure_vibrator(rig, card, Accelerometer(card), rms_g=0.3)
    np.testing.assert_allclose(found.frequency_hz, 150.0, rtol=0.01)
    np.testing.assert_allclose(found.bandwidth_hz, 40.0, rtol=0.05)
    np.testing.assert_allclose(found.height, 3.0, rtol=0.03)
    np.testing.assert_allclose(found.flat_gain, 5.0 / 2.0, rtol=0.02)  # full scale is 2 V
    assert found.simulated


def test_the_level_of_the_flat_part_is_found_and_written(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    card = CalculatedCard(rig, TRUTH)
    vibrator = measure_vibrator(rig, card, Accelerometer(card), rms_g=0.3)
    rig = RigFile.updated(rig.path, save_vibrator(rig, vibrator, "vibrator.json"))
    card = CalculatedCard(rig, TRUTH)
    gains = [
        measure_gain(rig, card, Accelerometer(card), rms_g=0.3, seed=seed).gain for seed in range(3)
    ]
    rig = RigFile.updated(
        rig.path, level_figures(rig, level_of(gains), band_hz=(100, 500), today=TODAY)
    )
    np.testing.assert_allclose(rig.vibrator.g_per_volt.value, 2.5, rtol=0.02)
    np.testing.assert_allclose(rig.fullscale_per_g, 1 / 5.0, rtol=0.02)
    assert not rig.vibrator.g_per_volt.assumed
    assert "100 to 500 Hz, 3 placements" in rig.vibrator.g_per_volt.source
    assert rig.vibrator.g_per_volt.source.endswith("simulated")
    assert rig.calibration is not None
    assert (rig.calibration.date, rig.calibration.serials) == (TODAY, ("A1",))


def test_once_calibrated_the_gain_is_one(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    flat = SimulatedTransducers(height=1.0001, g_per_fullscale=8.0)
    card = CalculatedCard(rig, flat)
    found = measure_gain(rig, card, Accelerometer(card), rms_g=0.3)
    np.testing.assert_allclose(found.gain, 1.0, rtol=5e-3)


def test_what_would_be_too_strong_is_noticed_at_a_tenth(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    card = CalculatedCard(rig, SimulatedTransducers(g_per_fullscale=100.0))
    with refused(InputError, expected="3 g", got=["18.1 g", "--level"]):
        check_softly(rig, card, Accelerometer(card), rms_g=0.3, band_hz=(100, 500))
    (played,) = card.played
    assert np.abs(played).max() <= 0.1 * 5 * 0.3


def test_lost_samples_are_played_again(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    card = CalculatedCard(rig, TRUTH, lost_first=2)
    measure_gain(rig, card, Accelerometer(card), rms_g=0.3)
    assert len(card.played) == 3
    card = CalculatedCard(rig, TRUTH, lost_first=3)
    with refused(InputError, expected=["accelerometer", "gaps"], got="lost"):
        measure_gain(rig, card, Accelerometer(card), rms_g=0.3)


def test_clipping_and_noise_are_refused(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    clipping = SimulatedTransducers(g_per_fullscale=5.0, sensor_fullscale_g=0.1)
    card = CalculatedCard(rig, clipping)
    with refused(InputError, expected=["1%", "clipped"], got="71.6%"):
        measure_gain(rig, card, Accelerometer(card), rms_g=0.3)
    noisy = SimulatedTransducers(g_per_fullscale=5.0, noise_g=3.0, sensor_fullscale_g=100.0)
    card = CalculatedCard(rig, noisy)
    with refused(InputError, expected=["coherence", 0.8], got=0.08):
        measure_gain(rig, card, Accelerometer(card), rms_g=0.3)


def test_a_missing_accelerometer_is_refused(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    text = rig.path.read_text()
    start, end = text.index("[accelerometer]"), text.index("[real_surface]")
    rig.path.write_text(text[:start] + text[end:])
    with refused(InputError, expected=["[accelerometer]", rig.path], got="none"):
        accelerometer_input(RigFile.load(rig.path))


def test_a_silent_device_is_refused(tmp_path: Path) -> None:
    card = CalculatedCard(rig_file(tmp_path), TRUTH)
    with refused(InputError, expected="accelerometer", got=["none", "[accelerometer]"]):
        Accelerometer(card).take()


def test_floor_and_loop_back_are_as_planted(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    card = CalculatedCard(rig, SimulatedTransducers(noise_g=0.01, hum_g=0.02, delay_s=0.012))
    accelerometer = Accelerometer(card)
    card.rest(4.0)
    record = accelerometer.take()
    assert record.time_s == 100.0
    floor = no_contact_floor(record.samples_g, rate_hz=record.rate_hz)
    rig = RigFile.updated(rig.path, floor_figures(rig, floor, today=TODAY))
    assert rig.accelerometer is not None
    assert rig.accelerometer.noise_floor_g is not None
    expected = np.sqrt(0.01**2 * 990 / 4000 + 0.02**2 / 2)
    np.testing.assert_allclose(rig.accelerometer.noise_floor_g.value, expected, rtol=0.02)
    assert "50 Hz hum" in rig.accelerometer.noise_floor_g.source


def test_the_loop_back_counts_from_the_first_sample_that_left(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)

    class Clocked(CalculatedCard):
        def play_signal(self, samples_g, *, compensated=False, wait=False):  # type: ignore[no-untyped-def]
            left_s = 100.2 + self._position / RATE_HZ
            super().play_signal(samples_g, compensated=compensated, wait=wait)
            return type("Left", (), {"time_s": left_s})()

    card = Clocked(rig, SimulatedTransducers(delay_s=0.012))
    delay_s = loop_back_s(card, Accelerometer(card), rate_hz=RATE_HZ, rms_g=0.3)
    assert abs(delay_s - 0.012) < 3e-4
    assert checked_loop_back_s(-5e-4) == -5e-4
    with refused(InputError, expected="after", got="3.0 ms"):
        checked_loop_back_s(-3e-3)


def test_gaps_are_told_from_late_clocks() -> None:
    rng = np.random.default_rng(1)
    late = rng.exponential(0.004, 200)
    late[::5] = 0.0
    assert gaps(late) == []
    late[100:] += 0.0107
    assert gaps(late) == [100]
    late[150:] += 0.003
    assert len(gaps(late)) == 2


def test_latency_is_written_with_its_reason(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    figures = latency_figures(
        rig, summary_of([0.05] * 50), how="a scripted hand", accepted="a pilot", today=TODAY
    )
    rig = RigFile.updated(rig.path, figures)
    assert rig.latency is not None
    assert rig.latency.p95_ms.value == 50.0
    assert "accepted: a pilot" in rig.latency.median_ms.source
    assert rig.latency.measured_on == TODAY
    rig.check_latency()
    for section, change in (("sound", {"block": 256}), ("hand", {"device": "other"})):
        other = replace(rig, **{section: replace(getattr(rig, section), **change)})
        with refused(InputError, expected=f"{section}.", got=next(iter(change.values()))):
            other.check_latency()
    replace(rig, latency=replace(rig.latency, rests_on=None)).check_latency()  # of an older file


def test_pressure_is_read_as_a_share_and_fitted(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    with Live.create() as live:
        for number in range(200):
            live.write_reading(0.001 * number, 0.0, y_mm=0.0, speed_mm_s=0.0, force_n=0.25, flags=1)
        with refused(InputError, expected=["pen", "0.01 s"], got="0 readings"):
            mean_pressure(live, seconds=0.01)  # what was written before does not count
    curve = fit_pressure([0.5, 1.0, 2.0], [0.1, 0.2, 0.5])
    rig = RigFile.updated(rig.path, pressure_figures(rig, curve, today=TODAY))
    assert rig.hand.pressure_curve is not None
    assert rig.hand.pressure_curve.points == ((0.1, 0.5), (0.2, 1.0), (0.5, 2.0))
    assert "residual 0.000 N" in rig.hand.pressure_curve.source


def test_a_held_pressure_is_averaged(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    with Live.create() as live, pressure_reader(rig, live):
        assert mean_pressure(live, seconds=0.5) == pytest.approx(1.5)  # the script's own force


def test_a_mouse_has_no_pressure(tmp_path: Path) -> None:
    rig = rig_file(tmp_path)
    mouse = """kind = "mouse"
counts_per_mm = { value = 40.0, unit = "counts/mm", assumed = true, source = "x" }
assumed_force_n = { value = 1.0, unit = "N", assumed = true, source = "x" }"""
    rig.path.write_text(rig.path.read_text().replace('kind = "scripted"', mouse))
    with Live.create() as live, refused(InputError, expected="tablet", got="mouse"):
        pressure_reader(RigFile.load(rig.path), live)
