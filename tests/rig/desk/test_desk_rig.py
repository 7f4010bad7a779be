"""The desk rig with its real processes: a scripted hand, and JACK's server without a card."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from datetime import date
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import InputError, TextureModel
from tactileq.rig.desk.checks import Requirements
from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.desk.stimuli import check_stimulus
from tactileq.rig.shared.interface import SURFACES, TextureRig, ToneBurst
from tactileq.rig.shared.live.clock import sleep, taking_part
from tactileq.rig.shared.live.memory import HEARTBEAT_S
from tactileq.stimuli.planted.textures import planted_texture
from tests.modeling.rendering.lattices import planted_ar
from tests.refusals import refused
from tests.rig.desk.rig_files import failures, rig_file
from tests.rig.devices.hand.board import Board, stating
from tests.rig.devices.hand.board import at_constant_speed as plain
from tests.rig.planted import planted_stimulus
from tests.rig.waiting import follow, wait_until

Jack = Callable[..., AbstractContextManager[Any]]


@pytest.fixture(scope="module")
def model() -> TextureModel:
    return planted_texture("PVC")


@pytest.fixture
def server(jack_server: Jack) -> Iterator[Any]:
    with jack_server(block=128) as running:
        yield running


def wait(rig: DeskRig, seconds: float) -> None:
    follow(seconds, rig.read)


def test_what_was_presented_and_what_the_hand_did_is_told(
    server: Any, tmp_path: Path, model: TextureModel
) -> None:
    file = rig_file(tmp_path)
    with DeskRig(file, override="a pilot", seed=5) as rig:
        stated = rig.stated
        as_protocol: TextureRig = rig
        assert as_protocol.simulated
        assert rig.health().hand_age_s < 5
        began_s, opened_s = rig.now_s(), time.monotonic()
        first_s = rig.present_model(model)
        wait(rig, 0.6)
        real_s = rig.present_real("PVC")
        wait(rig, 0.2)
        rig.silence()
        virtual, real = rig.take_presentations()
        rows = rig.take_history()
        lasted_s = time.monotonic() - opened_s  # JACK's server follows the computer's clock
    assert (stated["SHA256"], stated["Override"]) == (file.sha256, "a pilot")
    assert set(stated["Assumed"]) == set(dict(file.assumed()))  # type: ignore[call-overload]
    assert stated["Assumed"]["limits.peak_g"]["value"] == 5.0  # type: ignore[index]
    assert stated["File"] == file.to_dict()
    assert began_s < first_s == virtual.start_s < virtual.end_s <= real_s == real.start_s
    assert (virtual.surface, virtual.texture, virtual.number) == ("virtual", "PVC", 1)
    assert virtual.model_sha256 == model.sha256
    assert 0.1 < virtual.played_s < lasted_s
    assert 0 < virtual.rms_g < virtual.peak_g < 5.0
    assert virtual.dose_g2_s == pytest.approx(virtual.rms_g**2 * virtual.played_s)
    assert (real.surface, real.number, real.dose_g2_s, real.model_sha256) == ("real", 2, 0.0, "")
    assert np.all(np.diff(rows.time_s) >= 0)
    assert len(rows) / np.ptp(rows.time_s) >= 200
    of = {name: rows.surface == SURFACES.index(name) for name in SURFACES}
    assert all(mask.any() for mask in of.values())
    assert set(rows.presentation[of["virtual"]]) == {1}
    assert (
        np.nanmax(rows.speed_mm_s) - np.nanmin(rows.speed_mm_s) > 50
    )  # to and fro, so with its sign
    assert np.isfinite(rows.force_n[of["virtual"]]).mean() > 0.5
    assert np.isnan(rows.speed_mm_s[of["real"]]).all()  # nothing measures the hand there
    assert np.isnan(rows.force_n[of["real"]]).all()


@pytest.mark.parametrize(("lines", "told"), [(stating(b"wheel 2"), "wheel 2"), (plain, "n/a")])
def test_the_firmware_that_the_hands_sensor_states_is_stated(
    server: Any, tmp_path: Path, lines: Callable[[int], bytes], told: str
) -> None:
    board = Board()
    board.send(lines)
    hand = f'kind = "serial"\ndevice = "{board.path}"'
    with DeskRig(rig_file(tmp_path, ('kind = "scripted"', hand))) as rig:
        stated = rig.stated
        assert not failures(rig.take_faults())
    board.unplug()
    assert stated["HandFirmware"] == told
    assert stated["HandDevice"] == f"serial sensor at {board.path}"


def test_an_all_pole_model_is_presented_as_a_layered_one_is(
    server: Any, tmp_path: Path, model: TextureModel
) -> None:
    rival = planted_ar(0.02)
    with DeskRig(rig_file(tmp_path)) as rig:
        for presented in (rival, model, rival):
            rig.present_model(presented)
            wait(rig, 0.4)
        rig.silence()
        records = rig.take_presentations()
        assert failures(rig.take_faults()) == []
    assert [record.texture for record in records] == ["planted", "PVC", "planted"]
    assert [record.number for record in records] == [1, 2, 3]
    assert [record.model_sha256 for record in records] == [
        made.sha256 for made in (rival, model, rival)
    ]
    assert all(record.played_s > 0.1 and 0 < record.rms_g < 2.0 for record in records)
    assert records[0].counters.limited_peak == 0


def test_the_limits_of_the_rig_hold_for_all_pole_models(server: Any, tmp_path: Path) -> None:
    with DeskRig(rig_file(tmp_path)) as rig:
        rig.present_model(planted_ar(20.0))
        wait(rig, 0.4)
        rig.silence()
        (record,) = rig.take_presentations()
    assert record.peak_g == pytest.approx(5.0)  # of its limit
    assert record.counters.limited_peak > 0
    assert record.counters.limited_rms > 0


def test_bursts_play_one_after_the_other_whatever_the_hand_does(
    server: Any, tmp_path: Path
) -> None:
    burst = ToneBurst(frequency_hz=100.0, amplitude_g=0.5, duration_s=0.3)
    with DeskRig(rig_file(tmp_path)) as rig:
        first_s = rig.present_signal(burst)
        second_s = rig.present_signal(replace(burst, amplitude_g=0.0))  # waits for the first one
        third_s = rig.present_signal(replace(burst, frequency_hz=200.0))
        wait(rig, 0.4)
        rig.silence()
        records = rig.take_presentations()
        assert failures(rig.take_faults()) == []
    assert [record.texture for record in records] == ["100 Hz", "100 Hz", "200 Hz"]
    assert [record.start_s for record in records] == [first_s, second_s, third_s]
    assert all(later - earlier >= 0.3 for earlier, later in pairwise((first_s, second_s, third_s)))
    assert [record.peak_g for record in records] == pytest.approx([0.5, 0.0, 0.5], rel=1e-3)
    # Half the square of the amplitude; of each ramp of 20 ms 3/8 of what it would be without.
    dose_g2_s = 0.5 * 0.5**2 * (0.3 - 0.04 + 2 * 0.02 * 3 / 8)
    assert records[0].dose_g2_s == pytest.approx(dose_g2_s, rel=0.02)
    assert records[0].speeds_mm_s is None


def test_a_stimulus_leaves_bit_for_bit_and_is_broken_off_at_once(
    jack_server: Jack, tmp_path: Path
) -> None:
    rng = np.random.default_rng(3)
    samples = (0.2 * rng.uniform(-1, 1, 48000)).astype(np.float32).astype(np.float64)
    stimulus = planted_stimulus(samples, rate_hz=48000.0)
    with jack_server(block=128), DeskRig(rig_file(tmp_path)) as rig:
        first_s = rig.present_signal(stimulus)
        wait(rig, 0.2)
        second_s = rig.present_signal(stimulus)  # does not wait for the first one's end
        wait(rig, 1.3)
        rig.silence()
        first, second = rig.take_presentations()
        assert failures(rig.take_faults()) == []
        with refused(InputError, expected="48000 Hz", got=["PVC", "44100 Hz"]):
            rig.present_signal(replace(stimulus, rate_hz=44100.0))
        with refused(InputError, expected=["vibrator", tmp_path / "rig.toml"], got="PVC"):
            rig.present_signal(replace(stimulus, vibrator_sha256="c" * 64))
    assert second_s - first_s < 0.6
    assert (first.model_sha256, first.texture, first.speeds_mm_s) == ("a" * 64, "PVC", None)
    assert first.dose_g2_s < 0.6 * second.dose_g2_s
    assert second.dose_g2_s == pytest.approx(float(samples @ samples) / 48000, rel=1e-5)
    assert second.peak_g == pytest.approx(np.abs(samples).max(), rel=1e-6)


def test_stimuli_are_checked_without_a_device(tmp_path: Path) -> None:
    quiet = planted_stimulus(np.full(480, 0.1), rate_hz=48000.0)
    file = rig_file(tmp_path)
    check_stimulus(file, quiet)
    with refused(InputError, names="PVC", expected="5 g", got="5.1 g"):
        check_stimulus(file, replace(quiet, samples_g=np.full(480, 5.1)))
    with refused(InputError, expected="48000 Hz", got=["PVC", "44100 Hz"]):
        check_stimulus(file, replace(quiet, rate_hz=44100.0))


def test_no_burst_is_stronger_than_the_limits_allow(server: Any, tmp_path: Path) -> None:
    burst = ToneBurst(frequency_hz=100.0, amplitude_g=1.0, duration_s=0.3)
    with DeskRig(rig_file(tmp_path)) as rig:
        highest_g = rig.strongest_g(burst)
        # The running RMS (limit 2 g, window 1 s) may have been at its limit before.
        assert 2.0 * np.sqrt(2) == pytest.approx(highest_g, rel=0.1)
        rig.present_signal(replace(burst, amplitude_g=highest_g * (1 - 1e-6)))
        with refused(InputError, expected=["RMS", "2 g"], got="2.005 g"):
            rig.present_signal(replace(burst, amplitude_g=highest_g * 1.01))


def test_a_killed_sound_process_is_a_fault_and_the_next_presentation_plays(
    server: Any, tmp_path: Path, model: TextureModel
) -> None:
    with DeskRig(rig_file(tmp_path)) as rig:
        rig.present_model(model)
        pid = rig.parts.sound.pid
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        wait(rig, 0.1)
        rig.silence()
        (told,) = failures(rig.take_faults())
        assert "sound process" in told
        rig.present_model(model)
        wait(rig, 0.2)
        rig.silence()
        assert rig.parts.sound.pid != pid
        assert failures(rig.take_faults()) == []
        assert [record.played_s > 0.1 for record in rig.take_presentations()] == [False, True]


def test_a_session_that_hangs_is_a_fault_and_the_next_presentation_plays(
    server: Any, tmp_path: Path, model: TextureModel
) -> None:
    with DeskRig(rig_file(tmp_path)) as rig:
        with taking_part():
            rig.present_model(model)
            sleep(HEARTBEAT_S + 0.3)
            _, rows = rig.parts.live.blocks_since(0)
        rig.read()
        rig.silence()
        (told,) = failures(rig.take_faults())
        assert "poll the rig" in told
        # What plays next is looked after by who waits for its end, however long it is.
        burst = ToneBurst(frequency_hz=100.0, amplitude_g=0.5, duration_s=HEARTBEAT_S + 0.3)
        rig.present_signal(burst)
        rig.present_signal(replace(burst, duration_s=0.1))
        rig.silence()
        assert failures(rig.take_faults()) == []
        hung, long, _ = rig.take_presentations()
    # By the rig's clock: a server may give more blocks meanwhile, or fewer.
    assert 0.5 < np.ptp(rows["time_s"][rows["peak_g"] > 0]) < HEARTBEAT_S + 0.1
    assert hung.played_s > 0
    assert long.played_s > HEARTBEAT_S


def test_a_dead_server_is_a_fault_of_each_presentation_and_no_exception(
    server: Any, tmp_path: Path, model: TextureModel
) -> None:
    with DeskRig(rig_file(tmp_path)) as rig:
        rig.present_model(model)
        server.kill()
        rig.present_real("PVC")
        for _ in range(2):
            rig.present_model(model)
            rig.silence()
            assert failures(rig.take_faults())


def test_an_unplugged_hand_is_a_fault_and_its_rows_are_not_available(
    server: Any, tmp_path: Path, model: TextureModel
) -> None:
    with DeskRig(rig_file(tmp_path)) as rig:
        rig.present_model(model)
        rig.parts.reader.unplug()
        wait(rig, 0.4)
        assert (rig.read().speed_mm_s, rig.read().force_n) == (0.0, 0.0)
        assert any("plug" in told for told in rig.health().problems)
        rig.silence()
        told = [fault.sentence for fault in rig.take_faults() if fault.invalidates]
        assert any("unplugged" in sentence for sentence in told)
        assert any("reading of the hand" in sentence for sentence in told)
        (record,) = rig.take_presentations()
        assert record.stale_blocks > 0
        rows = rig.take_history()
        assert np.isnan(rows.speed_mm_s[-10:]).all()


def test_a_killed_reader_is_a_fault_and_is_replaced(
    server: Any, tmp_path: Path, model: TextureModel
) -> None:
    with DeskRig(rig_file(tmp_path)) as rig:
        rig.present_model(model)
        pid = rig.parts.reader.pid
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        wait_until(
            lambda: rig.parts.reader.pid not in (pid, None) and not rig.health().problems,
            every_s=0.05,
        )
        rig.silence()
        assert failures(rig.take_faults())
        rig.present_model(model)
        wait(rig, 0.1)
        rig.silence()
        assert failures(rig.take_faults()) == []


def test_what_cannot_be_opened_is_refused_in_one_sentence_and_leaves_the_rig_free(
    server: Any, tmp_path: Path
) -> None:
    for change, expected, got in (
        (("rate_hz = 48000", "rate_hz = 44100"), "'system'", ["44100 Hz", 48000]),
        (('device = "system"', 'device = "no such card"'), "'no such card'", "none"),
        (("g_per_volt = { value = 20.0", "g_per_volt = { value = 0.01"), "0.01 g", "5 g"),
        (('kind = "scripted"', 'kind = "scripted"\nscript = "none.csv"'), "none.csv", "nothing"),
    ):
        with refused(InputError, expected=expected, got=got) as caught:
            DeskRig(rig_file(tmp_path, change)).open()
        assert "\n" not in str(caught.value)
    rig = DeskRig(rig_file(tmp_path))
    for _ in range(2):  # it can be opened again, and closing twice is harmless
        rig.open()
        assert rig.health().hand_age_s < 5
        assert rig.present_real("PVC") < 5
        rig.close()
        rig.close()


def test_two_sessions_on_one_rig_are_refused(server: Any, tmp_path: Path) -> None:
    file = rig_file(tmp_path)
    with DeskRig(file) as rig:
        with refused(InputError, names=["rig.toml", os.getpid()]):
            DeskRig(file).open()
        assert rig.health().hand_age_s < 5
    old = Requirements(calibration_days=-1, measured_force=False)
    with refused(InputError, expected=["calibration", "-1 days", file.path], got=date.today()):
        DeskRig(file, requirements=old)
