"""`tactileq vibrator`: from a two-channel WAV to a file, a picture and one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PIL import Image

from tactileq.modeling import Limits, Vibrator, compensation_for
from tactileq.modeling.files.stimulus_table import STIMULUS_COLUMNS
from tactileq.modeling.files.tables import read_table
from tactileq.stimuli.exports.c_header import write_c_header
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import SimulatedVibrator

RATE_HZ = 22050


def record(path: Path, *, seconds: float = 12.0, sensor_noise: float = 0.1) -> Path:
    """A simulated white-noise test as an audio interface would record it."""
    rng = np.random.default_rng(4)
    drive = rng.uniform(-0.5, 0.5, round(seconds * RATE_HZ))
    vibrator = SimulatedVibrator(80.0, 3.0, RATE_HZ)
    # Noise of the given share of the flat part's level.
    noise = sensor_noise * 0.5 / np.sqrt(3)
    acceleration = 0.3 * vibrator.accelerate(drive, sensor_noise=noise, rng=rng)
    soundfile.write(path, np.stack([drive, acceleration], axis=1), RATE_HZ, subtype="PCM_24")
    return path


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("records") / "white-noise.wav")


def test_a_test_becomes_a_file_a_picture_and_one_line(run, tmp_path: Path, recorded: Path) -> None:
    done = run("vibrator", recorded, "--out", "rig/pen.json", "--plot", "pen.png", "--simulated")
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    assert line.startswith("simulated resonance 8")
    assert line.endswith(": rig/pen.json")
    assert "coherence 0.99; flat to ±3 dB from 1" in line
    found = Vibrator.load(tmp_path / "rig/pen.json")
    assert found.simulated
    assert found.frequency_hz == pytest.approx(80.0, rel=0.12)
    assert found.height == pytest.approx(3.0, rel=0.1)
    assert found.flat_gain == pytest.approx(0.3, rel=0.03)
    # What the compensation leaves of the true resonance, in the band that it is for.
    at = np.geomspace(80.0, 2000.0, 500)
    truth = np.abs(SimulatedVibrator(80.0, 3.0, RATE_HZ).response(at))
    product = truth * np.abs(compensation_for(found, rate_hz=RATE_HZ).response(at))
    assert np.abs(20 * np.log10(product)).max() < 2
    assert np.abs(20 * np.log10(truth)).max() > 9
    colours = np.unique(np.asarray(Image.open(tmp_path / "pen.png").convert("RGB")).reshape(-1, 3))
    assert colours.size > 20
    for file in ("rig/pen.json", "pen.png"):
        provenance = json.loads((tmp_path / f"{file}_provenance.json").read_text())
        assert provenance["command"] == "tactileq vibrator"
        assert list(provenance["inputs_sha256"]) == [str(recorded)]


def test_what_is_found_goes_into_stimuli_and_exports(main, tmp_path: Path, recorded: Path) -> None:
    for _ in range(2):  # its own files are replaced
        done = main("vibrator", recorded, "--out", "pen.json", "--plot", "pen.png", "--simulated")
        assert done.returncode == 0, done.stderr
    model = planted_texture("canvas")
    model.save(tmp_path / "canvas.json")
    found = Vibrator.load(tmp_path / "pen.json")
    done = main("stimuli", "canvas.json", "--vibrator", "pen.json", "--rate", 22050, "--out", "set")
    assert done.returncode == 0, done.stderr
    (row,) = read_table(tmp_path / "set/manifest.tsv", STIMULUS_COLUMNS)
    assert row["vibrator"] == "compensated"
    inputs = json.loads((tmp_path / "set/provenance.json").read_text())["inputs_sha256"]
    assert set(inputs) == {"canvas.json", "pen.json"}
    # The same vibration, in a file of its own.
    where = ("--speed", 150, "--force", 1.5, "--rate", 22050, "--out", "x.wav")
    done = main("export", "wav", "canvas.json", "--vibrator", "pen.json", *where)
    assert done.returncode == 0, done.stderr
    assert "as drive signal for the vibrator: x.wav" in done.stdout
    assert (tmp_path / "x.wav").read_bytes() == (tmp_path / "set" / row["file"]).read_bytes()
    limits = ("--peak", 0.5, "--rms", 0.2, "--duration", 60)
    done = main("export", "c", "canvas.json", "--vibrator", "pen.json", *limits)
    assert done.stdout == ("texture_canvas (simulated) for a vibrator (simulated): canvas.h\n"), (
        done.stderr
    )
    write_c_header(
        tmp_path / "expected.h",
        model,
        limits=Limits(peak=0.5, rms=0.2, duration_s=60.0),
        compensation=compensation_for(found, rate_hz=model.rate_hz),
    )
    text = (tmp_path / "expected.h").read_text(encoding="utf-8")
    expected = text.replace('#include "expected.h"', '#include "canvas.h"')
    assert (tmp_path / "canvas.h").read_text(encoding="utf-8") == expected
    settings = json.loads((tmp_path / "canvas.h_provenance.json").read_text())["settings"]
    assert settings["limits"] == {"peak": 0.5, "rms": 0.2, "duration_s": 60.0}


def test_other_files_are_not_overwritten(main, tmp_path: Path, recorded: Path) -> None:
    planted_texture("canvas").save(tmp_path / "canvas.json")
    (tmp_path / "photo.png").write_bytes(b"mine")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for options, name in (
        (("--out", "canvas.json"), "canvas.json"),
        (("--plot", "photo.png"), "photo.png"),
    ):
        refused = main("vibrator", recorded, *options)
        assert refused.returncode == 1
        assert f"earlier result of tactileq vibrator at {name}, got something" in refused.stderr
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_what_is_no_test_writes_nothing(main, tmp_path: Path, recorded: Path) -> None:
    poor = record(tmp_path / "poor.wav", sensor_noise=2.0)
    samples, _ = soundfile.read(recorded)
    soundfile.write(tmp_path / "mono.wav", samples[:, 0], RATE_HZ)
    before = set(tmp_path.iterdir())
    for arguments, sentence in (
        ((poor,), "expected a coherence of drive and acceleration of at least 0.8, got 0."),
        (("mono.wav",), "expected two channels in mono.wav, the drive and the acceleration, got 1"),
        (("missing.wav",), "expected a WAV file"),
        ((recorded, "--out", "pen.txt"), "expected a name that ends in .json, got pen.txt"),
        ((recorded, "--plot", "pen.pdf"), "expected a name that ends in .png, got pen.pdf"),
    ):
        refused = main("vibrator", *arguments)
        assert refused.returncode == 1
        assert refused.stderr.startswith("error: ")
        assert sentence in refused.stderr
        assert refused.stderr.count("\n") == 1
    assert set(tmp_path.iterdir()) == before
