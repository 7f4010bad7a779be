"""The kernel compiles for micro-controllers and as C++, with a C library or without."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tactileq.modeling.rendering
from tactileq.modeling import Limits, compensation_for
from tactileq.stimuli.exports.c_header import write_c_header
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator

HERE = Path(__file__).parent
KERNEL_FOLDER = Path(tactileq.modeling.rendering.__file__).parent
STRICT = ["-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror", "-ffp-contract=off"]
FREESTANDING = ["-DTQ_FREESTANDING", "-ffreestanding"]

needs_arm = pytest.mark.skipif(
    shutil.which("arm-none-eabi-gcc") is None,
    reason="arm-none-eabi-gcc is not installed (see tools/system-packages)",
)
needs_cpp = pytest.mark.skipif(
    shutil.which("g++") is None, reason="g++ is not installed (see tools/system-packages)"
)
M4 = ["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
M7 = ["-mthumb", "-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"]
TARGETS = {
    "M4F float": [*M4, "-DTQ_REAL=float"],
    "M7 float": [*M7, "-DTQ_REAL=float"],
    "M7 double": [*M7, "-DTQ_REAL=double"],
}
# The compiler may call these where there is no C library, too. Integers of 64 bits become doubles
# by a function of the compiler's own library.
CALLED = {"memcpy", "memmove", "memset"}
CALLED_IN_DOUBLE = CALLED | {"__aeabi_l2d"}


def compiled_by(command: list[str]) -> str:
    """What the compiler prints; it must succeed."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def object_for(folder: Path, target: str, *options: str) -> Path:
    """The kernel's two calls compiled for a micro-controller."""
    path = folder / "kernel.o"
    command = ["arm-none-eabi-gcc", "-std=c99", "-Wpedantic", *STRICT, *TARGETS[target], *options]
    command += [f"-I{KERNEL_FOLDER}", "-c", str(HERE / "linked_kernel.c"), "-o", str(path)]
    compiled_by(command)
    return path


def undefined(path: Path) -> set[str]:
    """Names that an object expects from elsewhere."""
    return set(compiled_by(["arm-none-eabi-nm", "-u", "-j", str(path)]).split())


@needs_arm
@pytest.mark.long("cross builds")
@pytest.mark.parametrize("target", TARGETS)
def test_on_a_micro_controller_nothing_is_called_but_copies(tmp_path: Path, target: str) -> None:
    """With -fno-math-errno a square root is one instruction, in the precision of the texture."""
    path = object_for(tmp_path, target, "-O2", "-fno-math-errno", *FREESTANDING)
    single = target.endswith("float")
    assert undefined(path) <= (CALLED if single else CALLED_IN_DOUBLE)
    text = compiled_by(["arm-none-eabi-objdump", "-d", str(path)])
    assert set(re.findall(r"vsqrt\.f(32|64)", text)) == {"32" if single else "64"}
    assert single == (re.search(r"\.f64\b", text) is None)


@needs_arm
@pytest.mark.long("cross builds")
def test_without_that_option_the_root_in_single_precision_is_called(tmp_path: Path) -> None:
    """For errno's sake. A root in double precision would cost an M4F hundreds of instructions."""
    assert undefined(object_for(tmp_path, "M4F float", "-O1")) <= CALLED | {"sqrtf"}


def lanes(command: list[str], *options: str) -> int:
    """TQ_LANES as a preprocessor finds it."""
    path = str(KERNEL_FOLDER / "kernel.h")
    macros = compiled_by([*command, "-E", "-dM", *FREESTANDING, *options, path])
    found = re.findall(r"^#define TQ_LANES (\d)$", macros, re.MULTILINE)
    assert len(found) == 1
    return int(found[0])


@needs_arm
@pytest.mark.long("cross builds")
@pytest.mark.parametrize("target", TARGETS)
def test_a_micro_controller_takes_one_layer_at_a_time(target: str) -> None:
    assert lanes(["arm-none-eabi-gcc", *TARGETS[target]]) == 1


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], 1),
        (["-D__SSE2__"], 2),
        (["-D__ARM_NEON"], 2),
        (["-D__wasm_simd128__"], 2),
        (["-D__SSE2__", "-DTQ_LANES=1"], 1),
    ],
)
def test_two_layers_at_a_time_where_vectors_are(options: list[str], expected: int) -> None:
    none = ["-U__SSE2__", "-U__ARM_NEON"]
    assert lanes(["gcc", *none], *options) == expected


C, CPP = ["-x", "c", "-std=c99"], ["-x", "c++", "-std=c++17"]
BUILDS = {
    "C++, double": ["g++", *CPP, "-DTQ_REAL=double"],
    "C++, float": ["g++", *CPP, "-DTQ_REAL=float"],
    "C, double, one lane": ["gcc", *C, "-DTQ_REAL=double", "-DTQ_LANES=1"],
    "C, float, one lane": ["gcc", *C, "-DTQ_REAL=float", "-DTQ_LANES=1"],
    "C, float, freestanding": ["gcc", *C, "-DTQ_REAL=float", "-DTQ_FREESTANDING"],
}
if shutil.which("clang"):  # the tests do without it
    BUILDS |= {
        "clang, C, double": ["clang", *C, "-DTQ_REAL=double"],
        "clang, C++, float": ["clang", *CPP, "-DTQ_REAL=float"],
    }


@needs_cpp
@pytest.mark.parametrize("compiler", [["gcc", *C], ["g++", *CPP]], ids=["C", "C++"])
def test_a_freestanding_kernel_goes_with_the_library_headers(
    tmp_path: Path, compiler: list[str]
) -> None:
    """Whichever comes first: it declares nothing that is theirs."""
    kernel, headers = '#include "linked_kernel.c"\n', "#include <math.h>\n#include <string.h>\n"
    for number, text in enumerate([kernel + headers, headers + kernel]):
        source = tmp_path / f"{number}.c"
        source.write_text(text, encoding="utf-8")
        options = ["-Wpedantic", *STRICT, "-DTQ_FREESTANDING", f"-I{KERNEL_FOLDER}", f"-I{HERE}"]
        assert compiled_by([*compiler, *options, "-fsyntax-only", str(source)]) == ""


PEAK, RATE_HZ = 0.1, 48_000.0


def stroke() -> np.ndarray:
    """Speeds and forces, (3000, 2), on the grid and out of it; a reading that is none."""
    share = np.arange(3000) / 3000
    hand = np.column_stack([400 * np.sin(9 * share), 1.5 + 2 * np.sin(14 * share)])
    hand[1000:1010, 0] = np.nan
    return hand


def rendered(folder: Path, compiler: list[str]) -> np.ndarray:
    """The stroke by a program of the exported header, compensated and limited."""
    header, program, source = folder / "a.h", folder / "program", HERE / "rendered_on_host.c"
    name = write_c_header(
        header,
        planted_texture("canvas"),
        rate_hz=RATE_HZ,
        single="-DTQ_REAL=float" in compiler,
        limits=Limits(peak=PEAK, rms=PEAK / 2, rms_window_s=0.01),
        compensation=compensation_for(planted_vibrator(), rate_hz=RATE_HZ),
    )
    # The table leaves out members that are 0, of which g++ warns in C++.
    options = ["-O1", *STRICT, "-Wno-missing-field-initializers"]
    options += [f'-DHEADER="{header}"', f"-DTEXTURE={name}"]
    compiled_by([*compiler, *options, str(source), "-o", str(program), "-lm"])
    run = subprocess.run([program], input=stroke().tobytes(), capture_output=True, check=True)
    return np.frombuffer(run.stdout)


@pytest.fixture(scope="module")
def in_c(tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """The samples of gcc's plain C build by precision."""
    return {
        precision: rendered(tmp_path_factory.mktemp("c"), ["gcc", *C, f"-DTQ_REAL={precision}"])
        for precision in ("double", "float")
    }


@needs_cpp
@pytest.mark.parametrize("build", BUILDS)
def test_every_build_renders_the_same_bits(
    tmp_path: Path, build: str, in_c: dict[str, np.ndarray]
) -> None:
    samples = rendered(tmp_path, BUILDS[build])
    assert np.array_equal(samples, in_c["double" if "double" in build else "float"])


def test_the_two_precisions_and_the_limits_are_what_they_claim(
    in_c: dict[str, np.ndarray],
) -> None:
    double, single = in_c["double"], in_c["float"]
    assert not np.array_equal(single, double)
    assert np.array_equal(single, single.astype(np.float32))
    assert np.abs(double).max() == PEAK
    assert np.abs(single).max() == np.float32(PEAK)
    assert np.isfinite(double).all()
