"""An exported texture renders on micro-controllers: QEMU's Cortex-M4 and M7, by serial port."""

from __future__ import annotations

import os
import re
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
from typing import Any

import numpy as np
import pytest

from tactileq.benches.rendering.rivals import layered_texture
from tactileq.modeling import Limits, Renderer, TextureModel
from tactileq.modeling.engines import SWITCH
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import RenderPlan, plan_for
from tactileq.modeling.scenes.microcontrollers import MicroController
from tactileq.stimuli.exports.c_header import write_c_header
from tactileq.stimuli.exports.scene_header import scene_header
from tactileq.stimuli.planted.textures import planted_texture

HERE = Path(__file__).parent
DOCS = HERE.parents[2] / "docs"
NEEDED = ("arm-none-eabi-gcc", "qemu-system-arm", "prlimit")
pytestmark = [
    pytest.mark.long("chips that QEMU emulates"),
    pytest.mark.skipif(
        not all(map(shutil.which, NEEDED)),
        reason=f"not all of {', '.join(NEEDED)} are installed (see tools/system-packages)",
    ),
]

CANVAS = planted_texture("canvas")
MDF = planted_texture("MDF")
SEED = 5
SWITCH_AT = 2560  # of a scene: while the hand is lifted off
SAMPLES, HOLD = 5000, 5  # readings at 1 kHz, samples at 5 kHz
BAND = 0.2  # for other versions of the compiler; a count is the same at every run
PATIENCE_S = 500.0  # an answer takes a second or two
TICK_NS = 40
COUNTING = ("-icount", "shift=0")  # every instruction takes 1 ns of the board's time
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
    """What came back: samples, and instructions for each, by a board that counts them."""

    samples: np.ndarray
    per_sample: float
    million_ns: float  # that a million instructions took


def built(folder: Path, board: Board, precision: str, *options: str) -> Path:
    """The program of `rendered_on_board.c` with the texture in it."""
    header = folder / "canvas.h"
    name = write_c_header(header, CANVAS, single=precision == "float")  # of another seed
    return built_with(header, board, f"-DTEXTURE={name}", *options)


def built_with_scene(
    folder: Path,
    board: Board,
    *rendered: tuple[TextureModel, RenderPlan],
    switch_at: int = SWITCH_AT,
) -> Path:
    """The same with a scene in it."""
    header = folder / "scene.h"
    text = scene_header(header.name, "boards", rendered, seed=SEED)
    header.write_text(text, encoding="utf-8")
    return built_with(header, board, "-DSCENE=scene_boards", f"-DSWITCH_AT={switch_at}")


def built_with(header: Path, board: Board, *options: str) -> Path:
    """The program with what this header holds."""
    program = header.with_name("program.elf")
    defines = [f'-DHEADER="{header}"', *options]
    # Newlib's small build; the start-up is the program's own.
    linked = ["-T", str(HERE / "mps2.ld"), "-nostartfiles", "-specs=nano.specs"]
    source = str(HERE / "rendered_on_board.c")
    command = ["arm-none-eabi-gcc", *EXACT, *STRICT, "-mthumb", *board.options, *defines, *linked]
    done = subprocess.run(
        [*command, source, "-o", program, "-lm"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return program


def sizes(program: Path) -> tuple[int, int]:
    """Bytes of code and tables in flash memory, and in RAM."""
    run = subprocess.run(
        ["arm-none-eabi-size", program], capture_output=True, text=True, check=True
    )
    text, data, bss = (int(part) for part in run.stdout.splitlines()[1].split()[:3])
    return text + data, data + bss


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


def hand() -> tuple[np.ndarray, np.ndarray]:
    """Speed and force of these readings at every sample."""
    counts = readings()
    speed = np.where(counts[:, 0] == -32768, np.nan, counts[:, 0] / 64)
    return np.repeat(speed, HOLD), np.repeat(counts[:, 1] / 4096, HOLD)


def expected() -> np.ndarray:
    """The same by the Python renderer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(SWITCH, "1")  # in Python alone: nothing of the kernel on this side
        renderer = Renderer(CANVAS, seed=SEED)
        samples = renderer.render(*hand())
    assert renderer.counters.lift_offs == 5 * HOLD
    return samples


def asked(port: int, precision: str, *, per_call: int, key: int | None = None) -> Answer:
    """The stroke rendered on the other side of a serial port; `key` is a scene's first texture."""
    key = int(stream_key(SEED)) if key is None else key
    real = np.dtype("<f8" if precision == "double" else "<f4")
    request = struct.pack("<4IQ", real.itemsize, SAMPLES, HOLD, per_call, key)
    answer = exchanged(port, request + readings().tobytes(), 8 + SAMPLES * real.itemsize + 4)
    body, check = answer[:-4], int.from_bytes(answer[-4:], "little")
    assert zlib.crc32(body) == check
    samples = np.frombuffer(body[8:], dtype=real).astype(float)
    million, ticks = struct.unpack("<2I", body[:8])
    return Answer(samples, 1e6 * ticks / million / SAMPLES, million * TICK_NS)


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


@pytest.mark.parametrize(
    ("board", "precision"), [(M7, "double"), (M4, "float")], ids=["M7 double", "M4F float"]
)
def test_a_scene_on_a_micro_controller_gives_the_bits_of_its_textures(
    tmp_path: Path, board: Board, precision: str
) -> None:
    """Where the hand is lifted off the next texture starts at once, in the next noise stream."""
    plan = plan_for(5000.0, single=precision == "float")
    with running(board, built_with_scene(tmp_path, board, (CANVAS, plan), (MDF, plan))) as port:
        answer = asked(port, precision, per_call=32, key=0)
    assert not answer.samples[SWITCH_AT - 5 : SWITCH_AT + 5].any()
    parts = (CANVAS, slice(0, SWITCH_AT)), (MDF, slice(SWITCH_AT, None))
    for stream, (model, part) in enumerate(parts):
        renderer = Renderer(model, seed=SEED, stream=stream, single=precision == "float")
        rendered = renderer.render(*(of[part] for of in hand()))
        assert np.array_equal(answer.samples[part], rendered)


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
        with running(request.param, program, *COUNTING) as port:
            answer = asked(port, "float", per_call=32)
        found[way] = Trial(answer.samples, sizes(program)[0], answer.per_sample)
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


def table_of_the_page() -> dict[int, list[int]]:
    """By layers, from docs/micro-controller.md: instructions, flash and RAM at 5 and at 48 kHz."""
    page = (DOCS / "micro-controller.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \|((?: \d+ \|){6})$", page, flags=re.MULTILINE)
    return {
        int(layers): [int(cell) for cell in re.findall(r"\d+", cells)] for layers, cells in rows
    }


@pytest.mark.parametrize("layers", [1, 2, 3, 4, 6, 8])
@pytest.mark.parametrize(("column", "rate_hz"), [(0, None), (3, 48_000.0)])
def test_instructions_and_bytes_are_those_of_the_page(
    tmp_path: Path, layers: int, column: int, rate_hz: float | None
) -> None:
    header, board = tmp_path / "canvas.h", DOCS / "micro-controller"
    limits = Limits(peak=5, rms=1, duration_s=60)
    texture, options = layered_texture(layers), {"rate_hz": rate_hz, "limits": limits}
    write_c_header(header, texture, single=True, name="canvas", **options)  # type: ignore[arg-type]
    build = ["arm-none-eabi-gcc", *EXACT, *STRICT, "-mthumb", *M4.options, f"-I{tmp_path}"]
    loop = tmp_path / "main.o"
    subprocess.run([*build, f"-I{board}", "-c", board / "main.c", "-o", loop], check=True)
    flash, ram = sizes(loop)
    instructions, *found = table_of_the_page()[layers][column : column + 3]
    assert [flash, ram] == pytest.approx(found, rel=BAND)
    if layers in (1, 8):
        with running(M4, built_with(header, M4, "-DTEXTURE=texture_canvas"), *COUNTING) as port:
            answer = asked(port, "float", per_call=5)
        assert answer.per_sample == pytest.approx(instructions, rel=BAND)


# Layers and samples from one update to the next, by output rate.
COSTS = {5000.0: [(1, 5), (3, 5), (8, 5), (8, 32)], 48_000.0: [(1, 48)]}


def instructions_per_operation(folder: Path, board: Board, precision: str) -> list[float]:
    """Of scenes whose hands stay on one texture each, in the order of `COSTS`."""
    found = []
    for rate_hz, textures in COSTS.items():
        options: dict[str, Any] = {"rate_hz": rate_hz, "single": precision == "float"}
        rendered = [
            (layered_texture(layers), plan_for(5000.0, update_samples=period, **options))
            for layers, period in textures
        ]
        program = built_with_scene(folder, board, *rendered, switch_at=SAMPLES)
        for index, (model, plan) in enumerate(rendered):
            with running(board, program, *COUNTING) as port:
                answer = asked(port, precision, per_call=32, key=index)
            assert answer.million_ns == pytest.approx(1e6, rel=1e-3)
            found.append(answer.per_sample / plan.cost(model).operations)
    return found


@pytest.mark.parametrize(
    ("board", "precision", "told"),
    [
        (M4, "float", MicroController.named("stm32l432").cycles_per_operation),
        (M7, "float", MicroController.named("teensy-4.1").cycles_per_operation),
        (M7, "double", 5.3),
    ],
    ids=["M4F float", "M7 float", "M7 double"],
)
def test_an_operation_takes_as_many_instructions_as_micro_controllers_say(
    tmp_path: Path, board: Board, precision: str, told: float
) -> None:
    """docs/method/rendering.md#instructions-per-operation: the most is what is reckoned with."""
    measured = instructions_per_operation(tmp_path, board, precision)
    print(f"\n{board.machine}, {precision}: {', '.join(f'{each:.2f}' for each in measured)}")
    assert max(measured) == pytest.approx(told, rel=BAND)
    assert min(measured) > 2
    one, three, eight, rarely, _ = measured
    assert one > three > eight > rarely
