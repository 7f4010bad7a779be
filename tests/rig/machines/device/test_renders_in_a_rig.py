"""A device that renders the texture of a rig: no sound card is there (the device is emulated)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.experiments.feel.opening import desk
from tactileq.modeling import InputError
from tactileq.rig.desk.checks import check_models
from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.desk.parts import vibration_output
from tactileq.rig.devices.sound.supervision import HALTED
from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.shared.interface import Stimulus, ToneBurst
from tactileq.rig.shared.live.clock import sleep
from tactileq.rig.shared.live.memory import HEARTBEAT_S, Live
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.textures import planted_texture
from tests.modeling.rendering.lattices import planted_ar
from tests.refusals import refused
from tests.rig.desk.rig_files import failures
from tests.rig.machines.device.test_in_a_rig import device_rig
from tests.rig.waiting import follow

RENDERS = """simulated = true
renders = true
volts_per_g = { value = 2.0, unit = "V/g", assumed = true, source = "a test" }
[force]"""
SLOW = """kind = "force"
filter_delay_s = { value = 0.05, unit = "s", assumed = true, source = "a test" }"""
RATE_HZ = 5000.0


def rendering_rig(folder: Path, address: str, *changes: tuple[str, str]) -> RigFile:
    """As `device_rig`, of a device that renders the texture."""
    return device_rig(folder, address, ("simulated = true\n[force]", RENDERS), *changes)


@contextmanager
def opened(folder: Path, address: str) -> Iterator[DeskRig]:
    with DeskRig(rendering_rig(folder, address), override="a test", seed=3) as rig:
        yield rig


def polled(rig: DeskRig, seconds: float) -> None:
    """Look after the rig for so long."""
    follow(seconds, rig.read, every_s=0.02)


def test_textures_and_tones_are_played_and_accounted_for(tmp_path: Path, device: Emulator) -> None:
    with opened(tmp_path, device.address) as rig:
        rig.arm()
        rig.present_model(planted_texture("canvas"))
        polled(rig, 0.9)
        rig.present_model(planted_texture("MDF"))
        polled(rig, 0.6)
        rig.silence()
        rig.present_signal(ToneBurst(frequency_hz=200.0, amplitude_g=0.2, duration_s=0.5))
        polled(rig, 0.6)
        rig.silence()
        faults = failures(rig.take_faults())
        rows = rig.take_history()
        canvas, mdf, burst = rig.take_presentations()
    assert faults == []
    assert np.nanmax(rows.force_n[rows.presentation == canvas.number]) > 0.2
    for one, seconds in ((canvas, 0.9), (mdf, 0.6)):
        assert one.played_s == pytest.approx(seconds, abs=0.3)
        assert one.peak_g > 0.01
        assert 0 < one.weighted_dose_g2_s < one.dose_g2_s
        assert one.dose_g2_s < one.peak_g**2 * one.played_s
        assert one.counters is not None
        assert 0 < one.counters.below_grid <= one.played_s * RATE_HZ  # strokes turn
        assert (one.counters.clamped, one.counters.limited_peak) == (0, 0)
    # Ramps of a burst: docs/method/live.md#signals
    assert burst.dose_g2_s == pytest.approx(0.2**2 / 2 * 0.5, rel=0.1)
    assert burst.peak_g == pytest.approx(0.2, rel=0.01)
    assert (burst.speeds_mm_s, burst.stale_blocks) == (None, 0)


def test_a_session_that_hangs_halts_what_plays(tmp_path: Path, device: Emulator) -> None:
    rig = rendering_rig(tmp_path, device.address)
    with Live.create() as live, vibration_output(rig, live) as sound:
        sound.play_signal(0.1 * np.ones(int(2.5 * RATE_HZ)))
        sleep(HEARTBEAT_S + 0.3)
        assert HALTED in sound.faults()
        assert sound.halted
        _, rows = live.blocks_since(0)
        assert rows["presentation"][-1] == 0
        assert rows["frames"][rows["presentation"] == 1].sum() < 1.2 * HEARTBEAT_S * RATE_HZ


def test_a_device_that_is_gone_is_a_fault_and_ends_no_session(
    tmp_path: Path, device: Emulator
) -> None:
    with opened(tmp_path, device.address) as rig:
        rig.arm()
        rig.present_model(planted_texture("canvas"))
        polled(rig, 0.3)
        device.close()
        polled(rig, 0.3)
        rig.present_model(planted_texture("MDF"))
        polled(rig, 0.1)
        rig.silence()
        faults = failures(rig.take_faults())
        first, second = rig.take_presentations()
    assert any("plays" in fault for fault in faults)
    assert first.stale_blocks > 0
    assert second.played_s == 0


def test_models_that_it_cannot_render_are_refused_before_a_session(tmp_path: Path) -> None:
    rig = rendering_rig(tmp_path, "/dev/ttyACM0")
    good = planted_texture("canvas")
    check_models(rig, [good])
    faster = planted_texture("canvas", rate_hz=10_000.0)
    with refused(InputError, expected="5000 Hz", got="10000 Hz"):
        check_models(rig, [good, faster])
    with refused(InputError, expected="layers", got="AR model"):
        check_models(rig, [planted_ar()])


def test_what_a_rig_file_says_of_it_has_to_fit(tmp_path: Path, device: Emulator) -> None:
    rig = rendering_rig(tmp_path, device.address)
    assert rig.output_rate_hz == RATE_HZ
    assert rig.fullscale_per_g == pytest.approx(1 / (2.0 * rig.vibrator.g_per_volt.value))
    no_volts = RENDERS.replace("volts_per_g", "# volts_per_g")
    with refused(InputError, expected="device.volts_per_g"):
        device_rig(tmp_path, device.address, ("simulated = true\n[force]", no_volts))
    with refused(InputError, expected="hand.filter_delay_s", got="50 ms"):
        rendering_rig(tmp_path, device.address, ('kind = "force"', SLOW))
    with refused(InputError, expected="whole ms", got="10.4 ms"):  # it would use 10
        rendering_rig(tmp_path, device.address, ('kind = "force"', SLOW.replace("0.05", "0.0104")))
    weak = ('value = 2.0, unit = "V/g"', 'value = 0.0001, unit = "V/g"')
    weak_rig = rendering_rig(tmp_path, device.address, weak)
    with (
        Live.create() as live,
        refused(InputError, expected="full scale of the device"),
        vibration_output(weak_rig, live),
    ):
        pass


def test_a_stimulus_has_to_have_the_rate_of_the_device(tmp_path: Path) -> None:
    rig = DeskRig(rendering_rig(tmp_path, "/dev/ttyACM0"), override="a test")
    made = Stimulus(
        texture="canvas",
        samples_g=np.zeros(100),
        rate_hz=48_000.0,
        vibrator_sha256=None,
        simulated=True,
        sha256="0" * 64,
        model_sha256="1" * 64,
    )
    with refused(InputError, expected="5000 Hz, the rate of the device", got="48000 Hz"):
        rig.check_stimulus(made)
    rig.check_stimulus(replace(made, rate_hz=RATE_HZ))


def test_visitors_feel_it_too(tmp_path: Path, device: Emulator) -> None:
    rendering_rig(tmp_path, device.address)
    with desk(tmp_path / "rig.toml") as felt:
        felt.present_model(planted_texture("canvas"))
        outputs = []

        def look() -> None:
            assert felt.take_faults() == ()
            outputs.append(felt.output())

        follow(1.5, look, every_s=0.05)
        felt.silence()
    assert max(one.rms_g for one in outputs if one is not None) > 0.01
    assert "simulated force device" in felt.notes
