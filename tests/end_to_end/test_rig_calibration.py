"""tactileq rig check, monitor, calibrate and latency on an audio server with a simulated vibrator.

A server without a card loses blocks on a busy machine. A measurement that notices refuses, and then
nothing may be written; where it does not refuse, it has to find what was planted.
"""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from tactileq.modeling import ARModel, TextureModel
from tactileq.rig.devices.simulated.card import DEVICE, SimulatedCard
from tactileq.rig.devices.simulated.vibrator import SimulatedTransducers
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.textures import planted_texture
from tests.modeling.rendering.lattices import planted_ar
from tests.rig.desk.calibration.card import rig_file
from tests.rig.desk.rig_files import calibrated

Jack = Callable[..., AbstractContextManager[Any]]
Run = Callable[..., subprocess.CompletedProcess[str]]
TRUTH = SimulatedTransducers(height=1.001, g_per_fullscale=5.0, delay_s=0.004)
DELAYED_MS = 4.0
BUSY = re.compile(
    r"lost samples|no block for|no trace|got it .* ms before|in at least 50 trials|coherence"
)


@pytest.fixture
def rig(jack_server: Jack, tmp_path: Path) -> Iterator[Path]:
    """A rig file of the simulated vibrator, which runs; levels are assumed 8 g per full scale."""
    device = f'device = "{DEVICE}"'
    file = rig_file(tmp_path, rate_hz=48000, sound=device, accelerometer=device).path
    with jack_server(block=1024), SimulatedCard(TRUTH):
        yield file


def prompted(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """`tactileq rig …` with somebody who presses Enter."""
    return subprocess.run(
        [sys.executable, "-m", "tactileq", "rig", *arguments],
        cwd=folder,
        input="\n" * 20,
        capture_output=True,
        text=True,
        timeout=500,
    )


def measured(done: subprocess.CompletedProcess[str], file: Path, before: str) -> bool:
    """Whether it was measured; where it was not, it says why and has written nothing."""
    if done.returncode == 0:
        return True
    assert done.returncode == 1, done.stderr
    assert done.stderr.startswith("error: expected ")
    assert BUSY.search(done.stderr), done.stderr
    assert file.read_text() == before
    return False


def refused_for(done: subprocess.CompletedProcess[str]) -> list[str]:
    lines = [line for line in done.stdout.splitlines() if line.startswith("no study can run:")]
    return [line.split(":")[1].strip() for line in lines]


def test_check_shows_what_is_there_and_why_it_is_not_enough(rig: Path, run: Run) -> None:
    done = run("rig", "check")
    assert done.returncode == 1, done.stdout + done.stderr
    assert refused_for(done) == ["calibration"]
    assert f"{DEVICE} does 48000 Hz with 2 output channel(s)" in " ".join(done.stdout.split())
    assert re.search(r"rig +calculated ", done.stdout)
    assert re.search(r"vibrator.g_per_volt +4 +g/V +assumed +a guess", done.stdout)
    calibrated(RigFile.load(rig))
    done = run("rig", "check")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.rstrip().endswith("A study can run on this rig.")
    rig.write_text(rig.read_text().replace(DEVICE, "no such card"))
    done = run("rig", "check")
    assert done.returncode == 1
    assert refused_for(done) == ["sound", "accelerometer"]
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("model", [planted_texture("canvas"), planted_ar()])
def test_monitor_ends_by_itself_with_a_line(
    rig: Path, run: Run, tmp_path: Path, model: TextureModel | ARModel
) -> None:
    model.save(tmp_path / "model.json")
    done = run("rig", "monitor", "model.json", "--seconds", "1.5")
    assert done.returncode == 0, done.stderr
    line = done.stdout.splitlines()[-1]
    blocks = re.search(r"(\d+) of (\d+) blocks missed \(a bare thread (\d+) of (\d+)", line)
    assert blocks is not None, done.stdout
    assert int(blocks[2]) > 0
    assert int(blocks[4]) > 0
    # Both are counted in the seconds that it states, not since their processes began.
    seconds, block_s = float(line.partition(" s: ")[0]), RigFile.load(rig).output_block_s
    assert seconds >= 1.5
    assert int(blocks[2]) * block_s <= seconds + 0.5
    assert int(blocks[4]) * block_s <= seconds + 0.5
    assert re.search(r"takes [\d.]+% of a block \(median\), [\d.]+% in 99.9 % of blocks$", line)


@pytest.mark.long("a whole measurement in real time")
def test_the_level_at_the_pen_is_measured(rig: Path) -> None:
    before = rig.read_text()
    done = prompted(rig.parent, "calibrate", "level", "--placements", "3")
    if measured(done, rig, before):
        loaded = RigFile.load(rig)
        assert abs(loaded.vibrator.g_per_volt.value / 2.5 - 1) < 0.1
        assert not loaded.vibrator.g_per_volt.assumed
        assert loaded.calibration is not None


@pytest.mark.long("a whole measurement in real time")
def test_latency_is_measured_from_hand_to_vibration(rig: Path) -> None:
    before = rig.read_text()
    done = prompted(rig.parent, "latency", "--trials", "50", "--accept", "a server without a card")
    if measured(done, rig, before):
        latency = RigFile.load(rig).latency
        assert latency is not None
        assert DELAYED_MS < latency.median_ms.value <= latency.p95_ms.value
        assert "simulated; accepted: a server without a card" in latency.p95_ms.source
        assert "hand to vibration, in total" in done.stdout


def test_without_an_accelerometer_nothing_is_calibrated(tmp_path: Path) -> None:
    file = rig_file(tmp_path).path
    text = file.read_text()
    start, end = text.index("[accelerometer]"), text.index("[real_surface]")
    file.write_text(text[:start] + text[end:])
    done = prompted(tmp_path, "calibrate", "level")
    assert done.returncode == 1
    assert "expected an [accelerometer] in rig.toml, got none" in done.stderr


def test_a_twin_runs_with_its_rig_file_until_ctrl_c(
    jack_server: Jack, run: Run, tmp_path: Path
) -> None:
    words = [sys.executable, "-m", "tactileq", "rig", "twin"]
    with jack_server(block=1024):
        twin = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
        assert twin.stdout is not None
        assert "Ctrl-C ends it" in twin.stdout.readline()
        done = run("rig", "check")
        assert refused_for(done) == ["calibration"], done.stdout + done.stderr
        assert "simulated rig (simulated)" in done.stdout
        again = run("rig", "twin")
        assert "error: expected a new rig file, got rig.toml, which exists" in again.stderr
        twin.send_signal(signal.SIGINT)
        assert twin.wait(500) == 0
        twin.stdout.close()


def test_a_twin_without_a_server_says_so(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JACK_DEFAULT_SERVER", "none")
    monkeypatch.setenv("JACK_NO_START_SERVER", "1")
    done = run("rig", "twin")
    assert done.returncode == 1
    assert "error: expected a JACK server for the simulated vibrator, got none" in done.stderr
