"""The C parts of the project and their cffi bindings; run by setup.py, without the project.

`tactileq.modeling.rendering._kernel` is the rendering kernel, `_kernel_single` the same in single
precision, `_many` renders many streams side by side, `tactileq.modeling.estimation._slopes` is what
the fit of layers spends its time on, `tactileq.benches.rendering._rivals` is what the bench
compares, `tactileq.rig.shared.live._live` is the memory that processes of a rig share, the callback
that plays and the servo of a force device, `tactileq.rig.machines.force._standin` a stand-in for
the library of its maker, `tactileq.rig.machines.device._device` the firmware on a simulated board,
`tactileq.rig.machines.recorder._recorder` the recorder's law on simulated mechanics.
"""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

ROOT = Path(__file__).resolve().parent.parent
KERNEL = ROOT / "modeling" / "rendering" / "kernel.h"
LATTICE = ROOT / "modeling" / "rendering" / "lattice.h"
MANY = ROOT / "modeling" / "rendering" / "many.h"
MANY_LANES = ROOT / "modeling" / "rendering" / "many_lanes.h"
SLOPES = ROOT / "modeling" / "estimation" / "slopes.h"
RIVALS = ROOT / "benches" / "rendering" / "rivals.h"
SOUNDS = ROOT / "benches" / "rendering" / "sounds.h"
PLAYER = ROOT / "modeling" / "rendering" / "player.h"
WEIGH = ROOT / "modeling" / "rendering" / "weigh.h"
SHARED = ROOT / "rig" / "shared" / "live"
CLOCK = SHARED / "clock.h"
LIVE = SHARED / "live.h"
SOUND = SHARED / "sound.h"
MACHINES = ROOT / "rig" / "machines"
BACKEND = MACHINES / "force" / "backend.h"
DHD = MACHINES / "force" / "dhd.h"
FORCE = MACHINES / "force" / "force.h"
OBSERVER = MACHINES / "force" / "observer.h"
STROKE = MACHINES / "force" / "stroke.h"
SERVO = MACHINES / "force" / "servo.h"
STANDIN = MACHINES / "force" / "standin.h"
BOARD = MACHINES / "board"
DEVICE = MACHINES / "device"
RECORDER = MACHINES / "recorder"
# For GCC and Clang. A multiplication contracted with an addition would round otherwise than Python.
COMPILER_ARGUMENTS = ["-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno"]
# No result changes, but both ways of a choice may be computed, which vectors do.
VECTOR_ARGUMENTS = [*COMPILER_ARGUMENTS, "-fno-trapping-math"]


def declarations(header: Path) -> str:
    """Structures and functions of a header as cffi wants them, but those of TQ_INLINE."""
    text = header.read_text(encoding="utf-8")
    structures = re.findall(r"^typedef struct \{.*?^\} \w+;$", text, re.DOTALL | re.MULTILINE)
    call = r"^static (?:inline )?([^;{}=]*?\([^)]*\))(?=\s*\{)"
    calls = re.findall(call, text, re.MULTILINE)
    return "\n".join([*structures, *(f"{call};" for call in dict.fromkeys(calls))])


def binding(
    name: str,
    *headers: Path,
    real: str = "double",
    constants: str = "TQ_KEPT, TQ_KEPT_DOUBLED, TQ_LANES, TQ_ROWS",
    included: tuple[Path, ...] = (),
    arguments: list[str] = COMPILER_ARGUMENTS,
) -> FFI:
    """A builder of extension `name` over these headers, the last one including the others."""
    builder = FFI()
    builder.cdef(
        f"typedef {real} tq_real; static const int {constants};"
        + "\n".join(declarations(header) for header in headers)
    )
    builder.set_source(
        name,
        f'#include "{headers[-1].name}"',
        include_dirs=[str(header.parent) for header in headers],
        depends=[str(header) for header in (*headers, *included)],
        define_macros=[("TQ_REAL", real), ("TQ_FLAGS", f'"{" ".join(arguments)}"')],
        extra_compile_args=arguments,
        optional=True,  # no compiler: Python does the same, slower
    )
    return builder


kernel = binding("tactileq.modeling.rendering._kernel", KERNEL)
kernel_single = binding("tactileq.modeling.rendering._kernel_single", KERNEL, real="float")
rivals = binding("tactileq.benches.rendering._rivals", KERNEL, RIVALS, SOUNDS)
many = binding(
    "tactileq.modeling.rendering._many",
    KERNEL,
    MANY,
    constants="TQ_BLOCK, TQ_STREAMS",
    included=(MANY_LANES,),
    arguments=VECTOR_ARGUMENTS,
)
slopes = binding(
    "tactileq.modeling.estimation._slopes", SLOPES, constants="TQ_SUMS", arguments=VECTOR_ARGUMENTS
)


def live_binding() -> FFI:
    """The builder of `_live`; what processes or threads share is opaque to Python."""
    voice = re.search(
        r"^typedef struct \{[^}]*\} tq_voice;$", PLAYER.read_text("utf-8"), re.MULTILINE
    )
    assert voice is not None
    builder = FFI()
    builder.cdef(
        "\n".join(
            (
                "typedef double tq_real; typedef double tq_number;",
                "static const int TQ_KEPT, TQ_KEPT_DOUBLED, TQ_LANES;",
                "static const int TQ_RING, TQ_ROWS, TQ_STATES, TQ_EVENTS, TQ_CAUSES;",
                "static const int TQ_WORD_ASKED, TQ_WORD_WALL, TQ_WORD_PRESS, TQ_WORD_TICK;",
                "static const int TQ_WORD_TICKS, TQ_WORD_STATE, TQ_WORD_FORCE, TQ_WORD_DEPTH;",
                "static const int TQ_WORD_PERIOD, TQ_WORD_WATCHDOG, TQ_SLOWEST;",
                "static const int TQ_DHD_STATUS, TQ_DHD_RESET;",
                "#define TQ_TRACK 256",
                "typedef struct tq_live tq_live; typedef struct tq_sound tq_sound;",
                "typedef struct tq_servo tq_servo;",
                declarations(KERNEL),
                declarations(LATTICE),
                voice[0],
                declarations(CLOCK),
                declarations(LIVE),
                declarations(SOUND),
                declarations(BACKEND),
                declarations(DHD),
                declarations(FORCE),
                declarations(STROKE),
                declarations(SERVO),
            )
        )
    )
    headers = (
        KERNEL,
        LATTICE,
        PLAYER,
        WEIGH,
        CLOCK,
        LIVE,
        SOUND,
        BACKEND,
        DHD,
        FORCE,
        STROKE,
        SERVO,
    )
    builder.set_source(
        "tactileq.rig.shared.live._live",
        f'#include "{SOUND.name}"\n#include "{SERVO.name}"',
        include_dirs=[str(PLAYER.parent), str(SOUND.parent), str(SERVO.parent)],
        depends=[str(header) for header in headers],
        define_macros=[("_GNU_SOURCE", None)],
        extra_compile_args=COMPILER_ARGUMENTS,
        optional=True,  # no compiler: everything but a live rig works
    )
    return builder


def standin_binding() -> FFI:
    """The builder of `_standin`: Force Dimension's functions without a device.

    It is loaded as the maker's is, and its further functions say what the device does and suffers.
    """
    builder = FFI()
    builder.cdef(declarations(STANDIN))
    builder.set_source(
        "tactileq.rig.machines.force._standin",
        f'#include "{STANDIN.name}"',
        include_dirs=[str(STANDIN.parent), str(LIVE.parent)],
        depends=[str(STANDIN), str(LIVE), str(CLOCK)],
        define_macros=[("_GNU_SOURCE", None)],
        extra_compile_args=COMPILER_ARGUMENTS,
        optional=True,
    )
    return builder


def headers_in(folders: list[Path]) -> list[str]:
    """All that a part may include."""
    return sorted(str(header) for folder in folders for header in folder.glob("*.h"))


def virtual_board() -> str:
    """Declarations of a simulated board in a process, whatever the device is."""
    public = r"^static (?:inline )?(\w[^;{}=]*?tq_virtual_(?:%s)\([^)]*\))(?=\s*\{)"
    names = "size|start|receive|step|take|given|shut|run"
    text = (BOARD / "virtual.h").read_text("utf-8")
    found = dict.fromkeys(re.findall(public % names, text, re.MULTILINE))
    return "\n".join(("typedef struct tq_virtual tq_virtual;", *(f"{call};" for call in found)))


def device_binding() -> FFI:
    """The builder of `_device`: the firmware on a simulated board."""
    builder = FFI()
    numbers = "typedef double tq_number;\n#define TQ_MOTORS 2"
    mechanics = (declarations(DEVICE / f"{name}.h") for name in ("cables", "mechanics"))
    builder.cdef("\n".join((numbers, *mechanics, virtual_board())))
    folders = [DEVICE, BOARD, FORCE.parent, KERNEL.parent, LIVE.parent]
    builder.set_source(
        "tactileq.rig.machines.device._device",
        '#include "virtual.h"',
        include_dirs=[str(folder) for folder in folders],
        depends=headers_in(folders),
        define_macros=[("_GNU_SOURCE", None)],
        extra_compile_args=COMPILER_ARGUMENTS,
        optional=True,
    )
    return builder


def recorder_binding() -> FFI:
    """The builder of `_recorder`: the recorder's law on simulated mechanics."""
    headers = [OBSERVER, *(RECORDER / f"{name}.h" for name in ("control", "plant"))]
    folders = [RECORDER, BOARD, FORCE.parent, LIVE.parent]
    builder = FFI()
    builder.cdef(
        "\n".join(
            (
                "typedef double tq_number;",
                "#define TQ_AXES 2",
                "static const int TQ_RESTS, TQ_SPINS, TQ_LOWERS, TQ_SETTLES, TQ_RUNS_IN;",
                "static const int TQ_RECORDS_NOW, TQ_LIFTS, TQ_RECORDED, TQ_FAILS;",
                *map(declarations, headers),
                virtual_board(),
            )
        )
    )
    builder.set_source(
        "tactileq.rig.machines.recorder._recorder",
        '#include "virtual.h"',
        include_dirs=[str(folder) for folder in folders],
        depends=headers_in(folders),
        define_macros=[("_GNU_SOURCE", None)],
        extra_compile_args=COMPILER_ARGUMENTS,
        optional=True,
    )
    return builder


live = live_binding()
standin = standin_binding()
device = device_binding()
recorder = recorder_binding()
