"""An audio input: bits and times as they came, what is lost is noticed, what cannot be refused."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.sound import devices
from tactileq.rig.recording.capture import input as audio
from tactileq.rig.recording.capture.input import AudioInput, InputSettings
from tests.refusals import refused

HERE = Path(__file__).parent
ROOT = HERE.parents[3]


def start(script: str, *arguments: object) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, str(HERE / script), *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def end(process: subprocess.Popen[str]) -> str:
    return process.communicate("\n", timeout=500)[0]


def test_what_another_client_plays_is_captured_bit_for_bit(jack_server, tmp_path: Path) -> None:
    """Ten seconds, as fast as both can: then no block is missed on a busy computer either."""
    played = np.random.default_rng(0).uniform(-1, 1, 480_000).astype(np.float32)
    np.save(tmp_path / "played.npy", played)
    with jack_server(block=256) as server:
        recording = start("capturing.py", tmp_path / "found.npz", 0)
        (entry,) = [port for port in server.ports() if port.endswith("in_0")]
        player = start("playing.py", tmp_path / "played.npy")
        (exit_,) = [port for port in server.ports() if port.endswith("out_0")]
        server.connect(exit_, entry)
        server.freewheel(True)
        assert end(player) == "played\n"
        server.freewheel(False)
        end(recording)
    found = np.load(tmp_path / "found.npz")
    samples = found["samples"]
    begin = int(np.flatnonzero(samples)[0])
    assert np.array_equal(samples[begin : begin + played.size], played.astype(float))
    assert not samples[begin + played.size :].any()
    assert found["rate_hz"] == 48000
    sizes = np.diff(np.append(found["position"], found["position"][0] + samples.size))
    assert (sizes == 960).all()


def test_times_of_samples_lie_between_opening_and_end(jack_server, tmp_path: Path) -> None:
    with jack_server(block=256) as server:
        recording = start("capturing.py", tmp_path / "found.npz", 0)
        assert server.ports()
        end(recording)
    found = np.load(tmp_path / "found.npz")
    assert found["running"]
    assert found["began_s"] - 1 < found["time_s"][0]
    assert found["time_s"][-1] < found["ended_s"]
    # What was lost moves on the time, and not the positions.
    span_s = found["time_s"][-1] - found["time_s"][0]
    assert span_s > (found["position"][-1] - found["position"][0]) / 48000 - 0.05
    if not found["lost"].any():
        assert span_s == pytest.approx(found["position"][-1] / 48000, abs=0.1)


def test_blocks_that_nobody_fetched_in_time_are_noticed(jack_server, tmp_path: Path) -> None:
    with jack_server(block=128) as server:
        recording = start("capturing.py", tmp_path / "found.npz", 0.6)
        assert server.ports()
        end(recording)
    assert np.load(tmp_path / "found.npz")["lost"].any()


def test_a_server_that_dies_ends_the_stream(jack_server, tmp_path: Path) -> None:
    with jack_server(block=256) as server:
        recording = start("capturing.py", tmp_path / "found.npz", 0)
        server.kill()
        assert recording.wait(timeout=500) == 0
    assert not np.load(tmp_path / "found.npz")["running"]


# --- What the audio system says, played by hand ---------------------------------------------------


def calls_of(*, overflow_at=(), late_at=(), slips_at=(), jitter_s=0.0):
    """Calls of 960 samples at 48 kHz, of a stream whose clock is 100 s behind the rig's.

    It tells of an overflow, or jumps by a block, or samples are missing and nothing tells.
    """
    rng = np.random.default_rng(0)
    missing_s = slipped_s = 0.0
    for n in range(100):
        missing_s += 0.02 * (n in late_at)
        slipped_s += 0.03 * (n in slips_at)
        current_s = n * 0.02 + 0.03 + missing_s
        yield audio._Call(
            np.full(960, float(n)),
            now_s=100.0 + slipped_s + current_s + rng.exponential(jitter_s or 1e-12),
            current_s=current_s,
            measured_s=current_s - 0.03,
            overflow=n in overflow_at,
        )


def test_times_are_when_samples_were_measured_without_the_latency() -> None:
    timeline = audio._Timeline(48000.0)
    blocks = [timeline.block(call) for call in calls_of(jitter_s=0.005)]
    expected = 100.0 + 0.02 * np.arange(100)
    # Whoever reads the clock late is late, so the earliest of some tells it.
    assert [b.time_s for b in blocks][25:] == pytest.approx(expected[25:], abs=0.002)
    assert [b.position for b in blocks] == list(range(0, 96000, 960))
    assert not any(b.lost for b in blocks)


def test_lost_samples_are_told_by_the_system_by_its_clock_or_by_ours() -> None:
    timeline = audio._Timeline(48000.0)
    calls = calls_of(overflow_at=[7], late_at=[30], slips_at=[60], jitter_s=0.001)
    blocks = [timeline.block(call) for call in calls]
    lost = [n for n, block in enumerate(blocks) if block.lost]
    # What nothing tells of shows once all blocks of the last half second are late.
    assert lost == [7, 30, 84]
    assert blocks[31].time_s - blocks[29].time_s == pytest.approx(0.06, abs=0.003)
    assert blocks[90].time_s == pytest.approx(100.0 + 90 * 0.02 + 0.02 + 0.03, abs=0.003)


# --- Bad input ------------------------------------------------------------------------------------

DEVICES = [
    ("HDMI", 0, 48000.0),
    ("USB Audio", 2, 44100.0),
    ("USB Accelerometer", 1, 8000.0),
]


class Refused(Exception):
    pass


def scripted_portaudio():
    """What is asked of sounddevice, for devices that are not there and are always in use."""

    def check_input_settings(device, *, channels, dtype, samplerate) -> None:
        if samplerate not in (44100, 48000):
            raise Refused("Invalid sample rate")

    def open_stream(**settings):
        raise Refused("Device unavailable")

    return SimpleNamespace(
        query_devices=lambda: [
            {
                "name": name,
                "hostapi": 0,
                "max_input_channels": inputs,
                "max_output_channels": 2,
                "default_samplerate": rate_hz,
            }
            for name, inputs, rate_hz in DEVICES
        ],
        query_hostapis=lambda: [{"name": "ALSA", "default_input_device": 1}],
        default=SimpleNamespace(device=(1, 0)),
        check_input_settings=check_input_settings,
        PortAudioError=Refused,
        InputStream=open_stream,
    )


@pytest.mark.parametrize(
    ("settings", "expected", "got"),
    [
        ({"device": "Tablet"}, "'Tablet'", ["none", "USB Audio, ALSA", "USB Accelerometer, ALSA"]),
        ({"device": "usb"}, "'usb'", ["USB Audio, ALSA", "USB Accelerometer, ALSA"]),
        ({"device": "HDMI"}, "'HDMI'", "none"),
        ({"rate_hz": 22704}, "'USB Audio'", ["22704 Hz", 44100, 48000]),
        ({"channel": 3}, [3, "input"], ["'USB Audio'", 2]),
        ({}, "'USB Audio'", "Device unavailable"),
    ],
)
def test_what_cannot_be_opened_is_refused_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch, settings, expected, got
) -> None:
    for module in (audio, devices):
        monkeypatch.setattr(module, "portaudio", scripted_portaudio)
    with refused(InputError, expected=expected, got=got):
        AudioInput(InputSettings(g_per_fullscale=1.0, **settings)).open()


@pytest.mark.parametrize(
    ("settings", "expected", "got"),
    [
        ({"g_per_fullscale": 0.0}, ["full-scale", "0 g"], 0.0),
        ({"g_per_fullscale": float("nan")}, ["full-scale", "0 g"], "nan"),
        ({"g_per_fullscale": 1.0, "channel": 0}, ["channel", 1, 64], 0),
        ({"g_per_fullscale": 1.0, "rate_hz": -1.0}, ["rate", 1, "10000000 Hz"], -1.0),
    ],
)
def test_settings_out_of_range_are_refused(settings, expected, got) -> None:
    with refused(InputError, expected=expected, got=got):
        InputSettings(**settings)
