"""tactileq record --audio and rig range: an audio server without a card, and a scripted hand."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tactileq.commands.recording.audio import InputOptions, input_from, print_assumed
from tactileq.modeling import RecordingSet
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.input import InputSettings
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE, RigFile
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.conftest import ENDED_WITH_US
from tests.opened import compared_with_provenance
from tests.rig.waiting import wait_until

ROOT = Path(__file__).parents[2]
PLAYING = ROOT / "tests/rig/recording/capture/playing.py"
# A scripted hand strokes as a sine of 150 mm/s at 1.5 N, so of these it reaches one.
GRID = "speeds_mm_s = [150, 300]\nforces_n = [1.5]\nspeed_tolerance = 0.3\n"
BY_HAND = ["--audio", "--texture", "oak", "--hand", "scripted", "--grid", "grid.toml"]
INPUT = ["--g-per-fullscale", "10", "--duration", "1.5"]


def begin(folder: Path, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "tactileq", *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
    )


def play_into(server, folder: Path) -> subprocess.Popen[str]:
    """Noise of 0.05 of full scale, into the recording's input."""
    noise = 0.05 * np.random.default_rng(0).normal(size=48000 * 60)
    np.save(folder / "noise.npy", noise.astype(np.float32))
    entry = server.wait_for_port("in_0")
    player = subprocess.Popen(
        [*ENDED_WITH_US, sys.executable, str(PLAYING), str(folder / "noise.npy")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert player.stdin is not None
    assert player.stdout is not None
    assert player.stdout.readline() == "ready\n"
    server.connect(server.wait_for_port("out_0"), entry)
    player.stdin.write("\n")
    player.stdin.flush()
    return player


def pieces_in(folder: Path) -> list[list[str]]:
    table = folder / "pieces/pieces.tsv"
    lines = table.read_text().splitlines()[1:] if table.is_file() else []
    return [line.split("\t") for line in lines]


@pytest.mark.timeout(120)  # which a blocked line would take
def test_a_recording_that_is_killed_goes_on_and_is_a_recording_set(
    jack_server, tmp_path: Path
) -> None:
    (tmp_path / "grid.toml").write_text(GRID)
    oak = tmp_path / "oak"
    with jack_server(block=256) as server:
        first = begin(tmp_path, "record", "oak", *BY_HAND, *INPUT)
        player = play_into(server, tmp_path)
        wait_until(lambda: len(pieces_in(oak)) >= 2 or first.poll() is not None, seconds=60)
        assert first.poll() is None
        first.send_signal(signal.SIGKILL)
        first.communicate(timeout=500)
        before = pieces_in(oak)
        player.kill()
        player.communicate(timeout=500)
        # Else the second one's noise might go to the first one's port.
        server.wait_until_gone("in_0", "out_0")

        second = begin(tmp_path, "record", "oak", *BY_HAND, *INPUT)
        player = play_into(server, tmp_path)
        assert second.stdout is not None
        line = second.stdout.readline()
        assert line == "1 of 2 conditions recorded\n", second.communicate(timeout=500)
        second.send_signal(signal.SIGINT)
        told, warned = second.communicate(timeout=500)
        player.kill()
        player.communicate(timeout=500)
    assert second.returncode == 130
    assert "1 of 2 conditions of oak recorded in oak, 1 of them in this run (simulated)\n" in told
    assert "missing: 300 mm/s at 1.5 N; run the command again to continue" in told
    assert "interrupted by SIGINT" in warned
    after = pieces_in(oak)
    assert after[: len(before)] == before
    assert len(after) > len(before)
    (record,) = RecordingSet.load(oak)
    assert record.condition == (150.0, 1.5)
    assert (record.simulated, record.unit, record.rate_hz) == (True, "g", 48000)
    assert record.duration_s == 1.5
    # Noise of 0.5 g; some of it may not have been played yet when the first pieces were cut.
    assert 0.25 < record.samples.std() < 0.52
    note = json.loads((oak / "provenance.json").read_text())
    assert note["command"] == "tactileq record --audio"
    assert list(note["inputs_sha256"]) == ["grid.toml"]
    assert note["settings"]["input"]["g_per_fullscale"] == 10
    assert set(note["input"]) == {
        *("clock_drift_ppm", "clock_jitter_ms", "lost_at_places", "rms_at_rest_g")
    }
    assert note["pieces"]["kept"] == len(after) - len(before)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ([], "expected a device that measures the hand, got neither --rig nor --hand"),
        (["--hand", "scripted"], "expected the acceleration of a full-scale sample of the input"),
        (["--hand", "pen"], "expected the kind of hand to be"),
        (["--hand", "scripted", *INPUT, "--grid", "none.toml"], "expected a grid (TOML) at none"),
        (["--rig", "rig.toml"], "expected a rig file at rig.toml, got nothing there"),
        (
            ["--hand", "mouse", "--counts-per-mm", "10", "--force", "1", *INPUT],
            "expected a hand whose force is measured for a grid of 7 forces, got one whose force",
        ),
        (["--hand", "mouse", "--counts-per-mm", "10", *INPUT], "expected assumed_force_n of a m"),
        (
            ["--hand", "window", "--counts-per-mm", "4", "--force", "1", *INPUT],
            "expected a hand that is read without a window",
        ),
        (["--hand", "scripted", *INPUT, "--device", "no such card"], "expected "),
        (["--hand", "scripted", *INPUT, "--channel", "65"], "expected the channel"),
    ],
)
def test_what_cannot_be_recorded_is_refused_in_one_sentence(
    main, tmp_path: Path, options, sentence
) -> None:
    refused = main("record", "oak", "--audio", "--texture", "oak", *options)
    assert refused.returncode == 1
    assert refused.stderr.startswith("error: expected ")
    assert sentence in refused.stderr or "channel" in sentence
    assert len(refused.stderr.splitlines()) == 1
    assert not (tmp_path / "oak").exists()


def test_options_of_the_hand_need_audio(main, tmp_path: Path) -> None:
    for options in (["--hand", "mouse"], ["--grid", "g.toml"], ["--repeat", 2], ["--simulated"]):
        refused = main("record", "canvas", "--texture", "canvas", *options)
        assert refused.returncode == 1
        assert "error: expected --audio with options of the hand" in refused.stderr
    assert not (tmp_path / "canvas").exists()


def rig_file(folder: Path, *, accelerometer: bool) -> Path:
    """The shipped one with a scripted hand, and an assumed accelerometer."""
    text = SHIPPED_RIG_FILE.read_text().replace('kind = "tablet"', 'kind = "scripted"')
    if accelerometer:
        text += """
[accelerometer]
device = "USB"
channel = 2
rate_hz = 44100
g_per_fullscale = { value = 50.0, unit = "g", assumed = true, source = "data sheet" }
"""
    (folder / "rig.toml").write_text(text)
    return folder / "rig.toml"


def test_the_accelerometer_of_a_rig_file_gives_way_to_options(tmp_path: Path, capsys) -> None:
    rig = RigFile.load(rig_file(tmp_path, accelerometer=True))
    assert input_from(rig, InputOptions()) == InputSettings(50.0, "USB", 2, 44100.0)
    given = InputOptions("other", 1, 48000.0, 8.0)
    assert input_from(rig, given) == InputSettings(8.0, "other", 1, 48000.0)
    print_assumed(rig)
    assert "50 g per full scale is assumed (data sheet)" in capsys.readouterr().out


def test_a_rig_without_an_accelerometer_needs_g_per_full_scale(main, tmp_path: Path) -> None:
    rig_file(tmp_path, accelerometer=False)
    refused = main("record", "oak", "--audio", "--texture", "oak", "--rig", "rig.toml")
    assert "expected the acceleration of a full-scale sample of the input, got" in refused.stderr
    both = main(
        *("record", "oak", "--audio", "--texture", "oak", "--rig", "rig.toml"),
        *("--hand", "mouse"),
    )
    assert "expected the hand in the rig file or on the command line, got both" in both.stderr


def test_free_strokes_give_a_grid_to_record(main, tmp_path: Path, monkeypatch) -> None:
    rig = rig_file(tmp_path, accelerometer=False)
    planted_vibrator().save(tmp_path / "vibrator.json")
    rig.write_text(rig.read_text().replace('# file = "vibrator.json"', 'file = "vibrator.json"'))
    with compared_with_provenance(tmp_path, monkeypatch):
        made = main("rig", "range", "--rig", "rig.toml", "--seconds", 6, "--forces", 1)
        assert made.returncode == 0, made.stderr
    grid = StrokeGrid.load(tmp_path / "grid.toml")
    assert grid.shape == (7, 1)
    # The 95th percentile of a sine of 150 mm/s is 149.5 mm/s.
    assert grid.speeds_mm_s[-1] == pytest.approx(150, abs=8)
    assert grid.forces_n.tolist() == [1.5]
    assert "simulated = true" in (tmp_path / "grid.toml").read_text()
    assert "note: the hand is simulated." in made.stdout
    assert "grid of 7 speeds x 1 force in grid.toml" in made.stdout
    told = json.loads((tmp_path / "grid.toml_provenance.json").read_text())
    assert told["command"] == "tactileq rig range"
    (tmp_path / "other.toml").write_text("mine = 1\n")
    refused = main("rig", "range", "--hand", "scripted", "--out", "other.toml")
    assert refused.returncode == 1
    assert "got something else; choose another name" in refused.stderr
