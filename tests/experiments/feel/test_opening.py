"""What a visitor feels with: a rig file's parts on an audio server without a card, or a pointer."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from tactileq.experiments.feel import opening
from tactileq.experiments.feel.live_rig import LiveRig
from tactileq.experiments.feel.opening import NO_SOUND, demonstration, desk
from tactileq.modeling import InputError, TextureModel, compensation_for
from tactileq.rig.devices.sound.devices import SoundDevice
from tactileq.rig.devices.sound.supervision import SoundLost
from tactileq.rig.machines.force.standin import StandIn
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.memory import CONTACT, FORCE_ASSUMED, GONE, HEARTBEAT_S, Live
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.refusals import refused
from tests.rig.machines.force.rig_files import force_rig

Jack = Callable[..., AbstractContextManager[Any]]
PATIENCE_S = 500.0  # for a hang, not for speed


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    """The shipped rig with a scripted hand on whatever sound there is."""
    text = SHIPPED_RIG_FILE.read_text(encoding="utf-8")
    text = text.replace('kind = "tablet"', 'kind = "scripted"')
    text = text.replace("simulated = false ", "simulated = true ")
    path = tmp_path / "rig.toml"
    path.write_text(text.replace('name = "desk rig"', f'name = "{tmp_path}"'), encoding="utf-8")
    return path


def wait_until(holds: Callable[[], Any]) -> Any:
    end = time.monotonic() + PATIENCE_S
    while not (found := holds()):
        assert time.monotonic() < end, "expected it within seconds, got nothing"
        time.sleep(0.01)
    return found


def louder_than_all_limits() -> TextureModel:
    canvas = planted_texture("canvas")
    return TextureModel(
        **{
            **{name: getattr(canvas, name) for name in ("speeds_mm_s", "forces_n", "level_sd_db")},
            **{name: getattr(canvas, name) for name in ("frequencies_hz", "bandwidths_hz")},
            "texture": "loud",
            "rate_hz": canvas.rate_hz,
            "noise_gains": 100 * canvas.noise_gains,
            "gains": 100 * canvas.gains,
            "estimator": "planted",
        }
    )


def test_a_rig_file_plays_and_tells_its_level_its_limits_and_its_faults(
    rig_file: Path, jack_server: Jack
) -> None:
    with jack_server(block=128) as server, desk(rig_file) as felt:
        assert felt.notes == ("simulated hand", "simulated sound card", "level not calibrated")
        assert wait_until(lambda: abs(felt.hand().speed_mm_s) > 20)
        assert felt.hand().force_n > 0
        assert felt.output().rms_g == 0
        felt.present_model(planted_texture("canvas"))
        output = wait_until(lambda: (now := felt.output()).rms_g > 0.01 and now)
        assert output.rms_g < output.peak_g < 3
        assert output.limits == ()
        assert output.latency_s > 0
        felt.present_model(louder_than_all_limits())
        assert "peak" in wait_until(lambda: felt.output().limits)
        assert felt.output().peak_g <= 3.0 * (1 + 1e-6)
        felt.mask(True)
        felt.mask(False)
        assert felt.take_faults() == ()
        felt.silence()
        wait_until(lambda: felt.output().rms_g == 0)

        felt.present_model(planted_texture("canvas"))
        os.kill(felt._sound.pid, signal.SIGKILL)
        (told,) = wait_until(felt.take_faults)
        assert "expected the sound process to play" in told
        wait_until(lambda: felt.output().rms_g > 0.01)  # another process plays on
        sleep(HEARTBEAT_S + 0.3)
        (told,) = wait_until(felt.take_faults)
        assert "poll the rig" in told
        assert felt.halted
        wait_until(lambda: felt.output().rms_g == 0)
        felt.present_model(planted_texture("canvas"))
        wait_until(lambda: felt.output().rms_g > 0.01)
        assert not felt.halted
        server.kill()
        with pytest.raises((SoundLost, InputError), match="expected"):
            wait_until(lambda: not felt.take_faults() and False)


def test_a_rig_is_felt_by_one_program_at_a_time(rig_file: Path, jack_server: Jack) -> None:
    with (
        jack_server(block=128),
        desk(rig_file),
        refused(InputError, names=os.getpid()),
        desk(rig_file),
    ):
        pass


def test_a_rig_without_its_sound_device_is_refused(rig_file: Path, jack_server: Jack) -> None:
    text = rig_file.read_text(encoding="utf-8")
    rig_file.write_text(
        text.replace("rate_hz = 48000\nblock", 'device = "none"\nrate_hz = 48000\nblock')
    )
    with (
        jack_server(block=128),
        refused(InputError, expected=["device", "'none'"]),
        desk(rig_file),
    ):
        pass


def test_without_a_rig_the_pointer_is_the_hand_and_silence_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def no_device(*_: object, **__: object) -> None:
        raise InputError("expected a sound device, got none; plug one in.")

    monkeypatch.setattr(opening, "find_device", no_device)
    with demonstration() as felt:
        pointer, silent = felt.notes
        assert pointer == "hand: mouse pointer (3.78 px/mm, 1.5 N assumed)"
        assert silent == NO_SOUND
        felt.present_model(planted_texture("canvas"))
        felt.mask(True)
        felt.silence()
        assert felt.output() is None
        assert felt.hand().force_n == 0
        began_s = now_s()
        fastest = 0.0
        while (elapsed := now_s() - began_s) < 0.5:
            felt.point(300 * elapsed * 3.78, 0.0, inside=True)
            fastest = max(fastest, abs(felt.hand().speed_mm_s))
            time.sleep(0.005)
        assert 100 < fastest < 1000  # of 300 mm/s, however late this machine is
        assert felt.hand().force_n == 1.5
        assert felt.hand().force_assumed
        felt.point(0.0, 0.0, inside=False)
        wait_until(lambda: felt.hand().force_n == 0)
        assert felt.take_faults() == ()


class NotedSound:
    """In place of a sound output: notes how it was made, and opens or not."""

    made: list[dict[str, Any]]
    lost = False

    def __init__(self, live: Live, **settings: Any) -> None:
        self.made.append(settings)

    def __enter__(self) -> NotedSound:
        if self.lost:
            raise SoundLost("expected a sound process that plays, got none; check the device.")
        return self

    def __exit__(self, *_: object) -> None:
        pass


@pytest.mark.parametrize("lost", [False, True])
def test_the_usual_sound_device_plays_within_what_it_has(
    monkeypatch: pytest.MonkeyPatch, lost: bool
) -> None:
    mono = SoundDevice(index=0, name="a loudspeaker", host="", inputs=0, outputs=1, rate_hz=44100.0)
    NotedSound.made, NotedSound.lost = [], lost
    monkeypatch.setattr(opening, "find_device", lambda *_: mono)
    monkeypatch.setattr(opening, "SoundOutput", NotedSound)
    vibrator = planted_vibrator()
    with demonstration(vibrator) as felt:
        told = NO_SOUND if lost else "sound: a loudspeaker, not calibrated"
        assert felt.notes[1] == told
    (made,) = NotedSound.made
    assert (made["channels"], made["masking_channel"], made["rate_hz"]) == (1, None, 44100.0)
    assert made["compensation"] == compensation_for(vibrator, rate_hz=44100.0)
    assert made["limits"].peak * made["fullscale_per_g"] <= 1


class NoHand:
    """In place of a reader, whose readings the test writes itself."""

    def faults(self) -> tuple[str, ...]:
        return ("the tablet is gone.",)


def test_a_late_or_gone_hand_is_none() -> None:
    with Live.create() as live:
        felt = LiveRig(live, NoHand(), None, pointed=False, notes=())
        assert not felt.hand().there

        def write(age_s: float, flags: int) -> None:
            live.write_reading(
                now_s() - age_s, 0.0, y_mm=0.0, speed_mm_s=-80.0, force_n=1.0, flags=flags
            )

        write(0.0, CONTACT | FORCE_ASSUMED)
        hand = felt.hand()
        assert (hand.there, hand.speed_mm_s, hand.force_n, hand.force_assumed) == (
            *(True, -80.0, 1.0, True),
        )
        write(0.0, 0)
        assert felt.hand().force_n == 0
        write(0.0, CONTACT | GONE)
        assert not felt.hand().there
        write(0.2, CONTACT)
        assert not felt.hand().there
        assert felt.take_faults() == ("the tablet is gone.",)


def test_a_force_device_is_armed_and_its_wall_felt(
    jack_server: Jack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TACTILEQ_STANDIN", str(tmp_path / "device"))
    file = force_rig(tmp_path).path
    with StandIn(tmp_path / "device") as device, jack_server(block=128), desk(file) as felt:
        assert {"simulated force device", "force commanded, not sensed"} <= set(felt.notes)
        felt.present_model(planted_texture("PVC"))

        def presses() -> bool:
            assert felt.take_faults() == ()
            return felt.hand().force_n > 0.3

        wait_until(presses)
        assert felt.hand().depth_mm > 0.3
        felt.silence()
        wait_until(lambda: max(map(abs, device.force_n(now_s()))) == 0)
        device.fields.nan_reads = 5
        wait_until(lambda: bool(felt.take_faults()))
        felt.present_model(planted_texture("PVC"))  # not by itself
        assert any("got a position that is none" in told for told in felt.take_faults())
        felt.arm()
        felt.present_model(planted_texture("PVC"))
        wait_until(presses)
