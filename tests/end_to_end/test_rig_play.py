"""tactileq rig play: what leaves the card, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.rig.desk.rig_files import rig_file

Jack = Callable[..., AbstractContextManager[Any]]
Run = Callable[..., subprocess.CompletedProcess[str]]
ROOT = Path(__file__).parents[2]
RECORDER = ROOT / "tests/rig/devices/sound/recorder.py"
TONE = ["rig", "play", "--rig", "rig.toml", "--tone", "250", "--amplitude", "1.5"]
RECIPE = """
version = 1
[set]
name = "one"
rate_hz = [{rate}]
format = "float32"
duration_s = 0.5
{more}
[[model]]
path = "canvas.json"
label = "full"
[[trajectory]]
speed_mm_s = 100
force_n = 1.0
"""


def made_set(main: Run, folder: Path, *, rate: int = 48000, more: str = "") -> Path:
    """A set of one file; the file."""
    planted_texture("canvas").save(folder / "canvas.json")
    planted_vibrator().save(folder / "vibrator.json")
    (folder / "recipe.toml").write_text(RECIPE.format(rate=rate, more=more))
    done = main("stimuli", "recipe.toml", "--out", "set")
    assert done.returncode == 0, done.stderr
    (file,) = (folder / "set").glob("*.wav")
    return file


def test_a_tone_and_a_file_leave_at_their_level(
    jack_server: Jack, main: Run, run: Run, tmp_path: Path
) -> None:
    rig_file(tmp_path)
    file = made_set(main, tmp_path)
    with jack_server(block=128) as server:
        words = [sys.executable, str(RECORDER), str(tmp_path / "out.npy"), "48000", "128", "0"]
        recorder = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert recorder.stdout is not None
        assert recorder.stdout.readline() == b"ready\n"
        # Whoever plays is heard by way of the server's own playback ports, once it is there.
        tone = subprocess.Popen(
            [sys.executable, "-m", "tactileq", *TONE],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            text=True,
        )
        played = server.wait_for_port(":out_0")
        server.connect(played, server.wait_for_port(":in_0"))
        said = tone.communicate(timeout=500)[0]
        recorder.communicate(timeout=500)
        told = run("rig", "play", "--rig", "rig.toml", "--set", "set", "--file", file.name)
    assert tone.returncode == 0
    assert "signal of 1 s played 1 time" in said
    captured = np.load(tmp_path / "out.npy")[:, 0] * 20.0  # 20 g at full scale, of 1 V
    assert np.abs(captured).max() == pytest.approx(1.5, rel=1e-3)
    assert told.returncode == 0, told.stderr
    assert "simulated signal of 0.5 s played 1 time" in told.stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "expected a tone (--tone) or a file of a set (--set and --file), got neither or both"),
        (("--tone", "250", "--set", "set", "--file", "x"), "got neither or both"),
        (("--set", "set"), "got neither or both"),
        (("--tone", "30000"), "expected a frequency between 0 and half the rate of 48000 Hz"),
        (("--tone", "250", "--amplitude", "9"), "expected a signal of at most 5 g, got 9 g"),
        (("--set", "none", "--file", "x"), "manifest.tsv"),
    ],
)
def test_what_cannot_be_played_is_refused(
    main: Run, tmp_path: Path, words: tuple[str, ...], sentence: str
) -> None:
    rig_file(tmp_path)
    done = main("rig", "play", "--rig", "rig.toml", *words)
    assert done.returncode == 1
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr


def test_a_file_of_another_rate_or_vibrator_is_refused(main: Run, tmp_path: Path) -> None:
    rig_file(tmp_path)
    file = made_set(main, tmp_path, rate=5000)
    done = main("rig", "play", "--rig", "rig.toml", "--set", "set", "--file", file.name)
    assert "expected a file at 48000 Hz, the rate of the card" in done.stderr
    other = tmp_path / "other"
    other.mkdir()
    (tmp_path / "set").rename(other / "set")
    file = made_set(main, tmp_path, more='vibrator = "vibrator.json"')
    done = main("rig", "play", "--rig", "rig.toml", "--set", "set", "--file", file.name)
    assert "which is compensated for another one" in done.stderr


def test_without_a_sound_device_one_sentence_says_so(run: Run, tmp_path: Path) -> None:
    rig_file(tmp_path)
    done = run("rig", "play", "--rig", "rig.toml", "--tone", "250")
    assert done.returncode == 1
    assert done.stderr.count("\n") <= 2
    assert "expected a sound device for output, got none; connect one" in done.stderr
