"""`tactileq export c|wav|json`: files for other programs, whole or not at all."""

from __future__ import annotations

import hashlib
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import soundfile

from tactileq.modeling import Renderer
from tactileq.stimuli.planted.textures import planted_texture

CANVAS = planted_texture("canvas")

PROGRAM = """
#include <stdio.h>
#include "canvas.h"
int main(void)
{
    static tq_real memory[texture_canvas_memory], speed[999], force[999], out[999];
    tq_state state;
    int n;
    for (n = 0; n < 999; n++) speed[n] = 150, force[n] = 2;
    tq_start(&texture_canvas, &state, memory, texture_canvas_key);
    tq_render(&texture_canvas, &state, speed, force, out, 999);
    return fwrite(out, sizeof *out, 999, stdout) != 999;
}
"""


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """canvas.json in the folder where the command runs."""
    CANVAS.save(tmp_path / "canvas.json")
    return tmp_path / "canvas.json"


def provenance(path: Path) -> dict[str, object]:
    found: dict[str, object] = json.loads(Path(f"{path}_provenance.json").read_text())
    return found


def test_a_header_is_a_renderer_of_its_own(run, model: Path, tmp_path: Path) -> None:
    done = run("export", "c", "canvas.json", "--rate", 8000, "--seed", 5)
    assert (done.returncode, done.stdout) == (0, "texture_canvas (simulated): canvas.h\n")
    made = provenance(tmp_path / "canvas.h")
    assert (made["command"], made["seed"]) == ("tactileq export c", 5)
    none = {"peak": None, "rms": None, "duration_s": None}
    settings = {"name": None, "rate_hz": 8000.0, "single": False, "limits": none}
    assert made["settings"] == settings
    sha256 = hashlib.sha256(model.read_bytes()).hexdigest()
    assert made["inputs_sha256"] == {"canvas.json": sha256}
    (tmp_path / "program.c").write_text(PROGRAM)
    compiler = ["gcc", "-std=c99", "-ffp-contract=off", "program.c", "-o", "program", "-lm"]
    subprocess.run(compiler, cwd=tmp_path, check=True)
    samples = subprocess.run([tmp_path / "program"], capture_output=True, check=True).stdout
    expected = Renderer(CANVAS, rate_hz=8000.0, seed=5).render(150.0, 2.0, samples=999)
    assert np.array_equal(np.frombuffer(samples), expected)
    again = run("export", "c", "canvas.json", "--single", "--out", "canvas.h")
    assert again.returncode == 0, again.stderr
    assert "#define TQ_REAL float" in (tmp_path / "canvas.h").read_text(encoding="utf-8")


def test_a_wav_is_told_with_its_level(main, model: Path, tmp_path: Path) -> None:
    options = ("--speed", 150, "--force", 1, "--duration", 2, "--rate", 44100)
    done = main("export", "wav", "canvas.json", *options, "--out", "new/x.wav")
    assert done.returncode == 0, done.stderr
    samples, rate_hz = soundfile.read(tmp_path / "new/x.wav")
    assert (rate_hz, samples.size) == (44100, 88200)
    level_db = 10 * np.log10(np.mean(samples[441:-441] ** 2))
    assert done.stdout == (
        f"canvas (simulated), 2 s at 44100 Hz, {level_db:.1f} dB re 1 g (RMS), peak "
        f"{np.abs(samples).max():.3g} g: new/x.wav\n"
    )
    assert provenance(tmp_path / "new/x.wav")["command"] == "tactileq export wav"
    beyond = main("export", "wav", "canvas.json", "--speed", 500, "--force", 1, "--duration", 0.1)
    assert beyond.returncode == 0
    assert "was recorded up to 350 mm/s" in beyond.stdout
    assert (tmp_path / "canvas.wav").exists()


def test_json_of_the_grid_and_of_one_condition(main, model: Path, tmp_path: Path) -> None:
    for options, count, told in (
        ((), 49, "49 conditions of canvas (simulated): canvas_peq.json\n"),
        (("--speed", 75, "--force", 2), 1, "1 condition of canvas (simulated): canvas_peq.json\n"),
    ):
        done = main("export", "json", "canvas.json", *options)
        assert (done.returncode, done.stdout) == (0, told)
        exported = json.loads((tmp_path / "canvas_peq.json").read_text(encoding="utf-8"))
        assert len(exported["conditions"]) == count
        assert exported["simulated"] is True
    assert provenance(tmp_path / "canvas_peq.json")["command"] == "tactileq export json"


WHERE = ("--speed", 150, "--force", 1)
REFUSED = {
    ("c", "nowhere.json"): "expected a model file at nowhere.json",
    ("c", "."): "expected a model file at .",
    ("c", "canvas.json", "--rate", 1000): "at least the model's 5000 Hz, got 1000",
    ("c", "canvas.json", "--rate", 0): "got 0",
    ("c", "canvas.json", "--rate", 1e12): "of at most 768000 Hz, got 1e+12",
    ("c", "canvas.json", "--peak", 0): "expected peak above 0 for limits, got 0.0",
    ("c", "canvas.json", "--vibrator", "canvas.json"): "expected the format tactileq.vibrator",
    ("c", "canvas.json", "--out", "canvas.json"): "got something else; choose another name",
    ("c", "canvas.json", "--out", "canvas.json/a.h"): "expected to read or write",
    ("wav", "canvas.json", *WHERE, "--rate", 1000): "at least the model's 5000 Hz",
    ("wav", "canvas.json", *WHERE, "--rate", 8000.5): "whole number",
    ("wav", "canvas.json", *WHERE, "--duration", 0): "duration_s",
    ("wav", "canvas.json", "--speed", -1, "--force", 1): "speed_mm_s, got -1.0",
    ("wav", "canvas.json", *WHERE, "--out", "canvas.json"): "something else; choose another name",
    ("json", "canvas.json", "--speed", 150): "expected a speed and a force",
    ("json", "canvas.json", "--speed", 400, "--force", 1): "got 400 mm/s and 1 N",
    ("json", "canvas.json", "--out", "canvas.json"): "earlier result of tactileq export json",
}


@pytest.mark.parametrize("arguments", REFUSED, ids=lambda a: " ".join(map(str, a)))
def test_what_is_refused_changes_nothing(main, model: Path, tmp_path: Path, arguments) -> None:
    before = model.read_bytes()
    done = main("export", *arguments)
    assert done.returncode == 1
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert REFUSED[arguments] in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["canvas.json"]
    assert model.read_bytes() == before
