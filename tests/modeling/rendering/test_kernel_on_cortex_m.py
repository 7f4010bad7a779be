"""An exported texture renders on micro-controllers: QEMU's Cortex-M4 and M7, by serial port."""

from __future__ import annotations

import os
import select
import shutil
import struct
import subprocess
import time
import tty
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from modeling import Renderer
from modeling.rendering.compiled import SWITCH
from modeling.rendering.noise import stream_key
from stimuli.exports.c_header import write_c_header
from stimuli.planted.textures import planted_texture

HERE = Path(__file__).parent
NEEDED = ("arm-none-eabi-gcc", "qemu-system-arm", "prlimit")
pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, NEEDED)),
    reason=f"not all of {', '.join(NEEDED)} are installed (see tools/system-packages)",
)

CANVAS = planted_texture("canvas")
SEED = 5
SAMPLES, HOLD = 5000, 5  # readings at 1 kHz, samples at 5 kHz
PATIENCE_S = 60.0  # an answer takes a second or two
EXACT = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno"]
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror"]
FREESTANDING = ["-DTQ_FREESTANDING", "-ffreestanding"]
DOUBLE_ROOT = "-DTQ_SQRT(x)=((tq_real)sqrt((double)(x)))"


@dataclass(frozen=True)
class Board:
    """One of ARM's MPS2 boards as QEMU knows it."""

    machine: str
    options: tuple[str, ...]


M4 = Board("mps2-an386", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"))
M7 = Board("mps2-an500", ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"))


@dataclass(frozen=True)
class Answer:
    """What came back: samples, and the ticks of 25 MHz that rendering took."""

    samples: np.ndarray
    ticks: int


def built(folder: Path, board: Board, precision: str, *options: str) -> Path:
    """The program of `rendered_on_board.c` with the texture in it."""
    header, program = folder / "canvas.h", folder / "program.elf"
    name = write_c_header(header, CANVAS, single=precision == "float")  # of another seed
    defines = [f'-DHEADER="{header}"', f"-DTEXTURE={name}", *options]
    # Newlib's small build; the start-up is the program's own.
    linked = ["-T", str(HERE / "mps2.ld"), "-nostartfiles", "-specs=nano.specs"]
    source = str(HERE / "rendered_on_board.c")
    command = ["arm-none-eabi-gcc", *EXACT, *STRICT, "-mthumb", *board.options, *defines, *linked]
    done = subprocess.run(
        [*command, source, "-o", program, "-lm"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return program


def code_bytes(program: Path) -> int:
    """Of code and tables in flash memory."""
    run = subprocess.run(
        ["arm-none-eabi-size", program], capture_output=True, text=True, check=True
    )
    text, data = run.stdout.splitlines()[1].split()[:2]
    return int(text) + int(data)


@contextmanager
def running(board: Board, program: Path, *options: str) -> Iterator[int]:
    """A raw file descriptor of the pseudo-terminal that is the board's serial port."""
    # The program never idles, so QEMU ends by itself even if the tests were killed.
    command = ["prlimit", f"--cpu={PATIENCE_S:.0f}"]
    command += ["qemu-system-arm", "-M", board.machine, "-display", "none", "-monitor", "none"]
    command += ["-serial", "pty", "-kernel", str(program), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as qemu:
        try:
            assert qemu.stdout is not None
            assert select.select([qemu.stdout], [], [], PATIENCE_S)[0], "QEMU says nothing"
            line = qemu.stdout.readline().decode()
            assert "redirected to /dev/" in line, line  # char device redirected to PATH (label …)
            port = os.open(line.split("redirected to ")[1].split()[0], os.O_RDWR | os.O_NOCTTY)
            try:
                tty.setraw(port)
                yield port
            finally:
                os.close(port)
        finally:
            qemu.kill()


def readings() -> np.ndarray:
    """Speed in 1/64 mm/s and force in 1/4096 N, exact in single precision: strokes that leave the
    grid, a rest, a lift-off and a reading that is none."""
    time_s = np.arange(SAMPLES // HOLD) * HOLD / 5000.0
    speed = 380 * np.sin(2 * np.pi * 2.5 * time_s)
    force = 1.8 + 2 * np.sin(2 * np.pi * 3.1 * time_s)
    speed[300:340] = 0
    force[500:520] = 0
    counts: np.ndarray = np.rint(np.column_stack([speed * 64, force * 4096])).astype("<i2")
    counts[700:705, 0] = -32768
    return counts


def expected() -> np.ndarray:
    """The same by the Python renderer."""
    counts = readings()
    speed = np.where(counts[:, 0] == -32768, np.nan, counts[:, 0] / 64)
    hand = np.repeat(speed, HOLD), np.repeat(counts[:, 1] / 4096, HOLD)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(SWITCH, "1")  # in Python alone: nothing of the kernel on this side
        renderer = Renderer(CANVAS, seed=SEED)
        samples = renderer.render(*hand)
    assert renderer.counters.lift_offs == 5 * HOLD
    return samples


def asked(port: int, precision: str, *, per_call: int) -> Answer:
    """The stroke rendered on the other side of a serial port."""
    real = np.dtype("<f8" if precision == "double" else "<f4")
    request = struct.pack("<4IQ", real.itemsize, SAMPLES, HOLD, per_call, int(stream_key(SEED)))
    answer = exchanged(port, request + readings().tobytes(), 4 + SAMPLES * real.itemsize + 4)
    body, check = answer[:-4], int.from_bytes(answer[-4:], "little")
    assert zlib.crc32(body) == check
    samples = np.frombuffer(body[4:], dtype=real).astype(float)
    return Answer(samples, int.from_bytes(body[:4], "little"))


def exchanged(port: int, message: bytes, size: int) -> bytes:
    """`size` bytes that answer a message."""
    answer, end = b"", time.monotonic() + PATIENCE_S
    while len(answer) < size:
        assert time.monotonic() < end, f"{len(answer)} of {size} bytes came"
        readable, writable, _ = select.select([port], [port] if message else [], [], 1.0)
        if writable:
            message = message[os.write(port, message[:1024]) :]
        if readable:
            answer += os.read(port, size - len(answer))
    return answer


@pytest.mark.parametrize("options", [[], FREESTANDING], ids=["newlib", "freestanding"])
def test_double_precision_on_a_cortex_m7_gives_the_bits_of_python(
    tmp_path: Path, options: list[str]
) -> None:
    program = built(tmp_path, M7, "double", *options)
    with running(M7, program) as port:
        answer = asked(port, "double", per_call=32)
    assert np.array_equal(answer.samples, expected())


WAYS = {
    "default": [],
    "two lanes": ["-DTQ_LANES=2"],
    "two lanes, double root": ["-DTQ_LANES=2", DOUBLE_ROOT],
}


@dataclass(frozen=True)
class Trial:
    """A build in single precision: its answer, its code and tables in bytes, its instructions."""

    samples: np.ndarray
    code_bytes: int
    per_sample: float


@pytest.fixture(scope="module", params=[M4, M7], ids=["M4F", "M7"])
def trials(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Trial]:
    """By the ways in which the texture was built. In calls of 32 samples; updates every five."""
    found = {}
    for way, options in WAYS.items():
        program = built(tmp_path_factory.mktemp("program"), request.param, "float", *options)
        # An instruction takes 1 ns of the board's time, a tick of its timer 40 ns.
        with running(request.param, program, "-icount", "shift=0") as port:
            answer = asked(port, "float", per_call=32)
        found[way] = Trial(answer.samples, code_bytes(program), answer.ticks * 40 / SAMPLES)
    told = ", ".join(f"{way} {t.per_sample:.0f} ({t.code_bytes} bytes)" for way, t in found.items())
    print(f"\n{request.param.machine}, instructions per sample, 4 layers at 5 kHz: {told}")
    return found


def test_single_precision_on_a_micro_controller_differs_by_rounding(
    trials: dict[str, Trial],
) -> None:
    python, trial = expected(), trials["default"]
    error = np.abs(trial.samples - python).max() / np.abs(python).max()
    print(f"single precision: {error:.1e} of the largest sample")
    assert 0 < error < 1e-5
    assert trial.code_bytes < 16_000


def test_lanes_change_no_bit(trials: dict[str, Trial]) -> None:
    for trial in trials.values():
        assert np.array_equal(trial.samples, trials["default"].samples)


def test_the_default_takes_the_fewest_instructions(trials: dict[str, Trial]) -> None:
    default = trials["default"].per_sample
    assert all(default <= trial.per_sample for trial in trials.values())
    assert 50 < default < 900
