"""docs/micro-controller: the main loop from ADC to DAC plays what this program renders."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import Limits, Renderer
from tactileq.stimuli.exports.c_header import write_c_header
from tactileq.stimuli.planted.textures import planted_texture

ROOT = Path(__file__).parents[3]
SOURCE = ROOT / "docs/micro-controller"
# A board whose ADC reads numbers from a file, and whose DAC writes each half as it is played.
BOARD = r"""
#include <stdio.h>
#include <stdlib.h>
#include "board.h"
static const uint16_t *played;
static size_t count;
static int half = 1;
static uint16_t now[2];
uint16_t board_position(void)
{
    if (fread(now, sizeof now[0], 2, stdin) != 2)
        exit(0);
    return now[0];
}
uint16_t board_force(void) { return now[1]; }
void board_play(const uint16_t *values, size_t of) { played = values, count = of / 2; }
int board_half(void)
{
    half = !half;
    fwrite(played + (size_t)half * count, sizeof *played, count, stdout);
    return half;
}
"""
LIMITS = Limits(peak=5.0, rms=1.0, duration_s=60.0)
BACK, HALF = 16, 5
CANVAS = planted_texture("canvas")
STRICT = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_c_header(tmp_path / "canvas.h", CANVAS, single=True, limits=LIMITS, name="canvas")
    (tmp_path / "stub.c").write_text(BOARD)
    return tmp_path


def readings() -> np.ndarray:
    """Place and force in counts, a millisecond apart: strokes, a rest, a lift-off."""
    time_s = np.arange(BACK + 1200) / 1000
    place = 2048 + 1500 * np.sin(2 * np.pi * 0.8 * time_s)
    force = 1500 + 700 * np.sin(2 * np.pi * 1.3 * time_s)
    place[400:480] = place[400]
    force[700:800] = 20
    counts: np.ndarray = np.rint(np.column_stack([place, force])).astype("<u2")
    return counts


def expected(counts: np.ndarray) -> np.ndarray:
    """What the DAC is sent, by the renderer in Python."""
    renderer = Renderer(CANVAS, single=True, limits=LIMITS)
    single = np.float32
    sent = []
    for turn in range(BACK, len(counts)):
        moved = int(counts[turn, 0]) - int(counts[turn - BACK, 0])
        speed = single(moved) * (single(100) / single(4096) * single(1000) / single(BACK))
        force = single(int(counts[turn, 1]) - 60) * (single(5) / single(4096))
        renderer.read(float(speed), float(force), ago=HALF)
        sent.append(single(2048.5) + single(400) * renderer.render_on(HALF).astype(single))
    return np.clip(np.concatenate(sent), 0, 4095).astype("<u2")


def test_the_main_loop_sends_the_dac_what_python_renders(folder: Path) -> None:
    build = ["cc", *STRICT, "-Werror", f"-I{folder}", f"-I{SOURCE}", SOURCE / "main.c", "stub.c"]
    subprocess.run([*build, "-o", "loop", "-lm"], cwd=folder, check=True)
    counts = readings()
    run = subprocess.run(
        [folder / "loop"], input=counts.tobytes(), capture_output=True, check=True, timeout=500
    )
    played = np.frombuffer(run.stdout, dtype="<u2").astype(int)
    assert (played[: 2 * HALF] == 2048).all()  # at rest until the first half is filled
    # Each half is played one turn after the other half has begun; the last one is no longer played.
    sent = expected(counts).astype(int)
    differences = np.abs(played[2 * HALF :] - sent[: len(played) - 2 * HALF])
    assert played.size - 2 * HALF > 5000
    assert np.ptp(sent) > 100
    assert differences.max() <= 1  # at a border between two counts
    assert (differences > 0).mean() < 0.001
    lifted = slice(5 * (700 - BACK + 30), 5 * (800 - BACK - 5))
    assert (sent[lifted] == 2048).all()


def test_the_page_shows_the_code_that_runs() -> None:
    page = (ROOT / "docs/micro-controller.md").read_text(encoding="utf-8")
    for name in ("main.c", "board.h"):
        code = (SOURCE / name).read_text(encoding="utf-8")
        assert f"```c\n{code}```" in page, name
