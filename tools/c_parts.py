"""The C parts of the project and their cffi bindings; run by setup.py, without the project.

`modeling.rendering._kernel` is the rendering kernel, `_kernel_single` the same in single precision,
`_many` renders many streams side by side, `modeling.estimation._slopes` is what the fit of layers
spends its time on, `benches.rendering._rivals` is what the bench compares,
`rig.live._live` is the memory that processes of a rig share and the callback that plays.
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
LIVE = ROOT / "rig" / "live" / "live.h"
SOUND = ROOT / "rig" / "live" / "sound.h"
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
    return "\n".join([*structures, *(f"{call};" for call in calls)])


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


kernel = binding("modeling.rendering._kernel", KERNEL)
kernel_single = binding("modeling.rendering._kernel_single", KERNEL, real="float")
rivals = binding("benches.rendering._rivals", KERNEL, RIVALS, SOUNDS)
many = binding(
    "modeling.rendering._many",
    KERNEL,
    MANY,
    constants="TQ_BLOCK, TQ_STREAMS",
    included=(MANY_LANES,),
    arguments=VECTOR_ARGUMENTS,
)
slopes = binding(
    "modeling.estimation._slopes", SLOPES, constants="TQ_SUMS", arguments=VECTOR_ARGUMENTS
)


def live_binding() -> FFI:
    """The builder of `rig.live._live`; what processes or threads share is opaque to Python."""
    voice = re.search(
        r"^typedef struct \{[^}]*\} tq_voice;$", PLAYER.read_text("utf-8"), re.MULTILINE
    )
    assert voice is not None
    builder = FFI()
    builder.cdef(
        "\n".join(
            (
                "typedef double tq_real; static const int TQ_KEPT, TQ_KEPT_DOUBLED, TQ_LANES;",
                "static const int TQ_RING, TQ_ROWS;",
                "typedef struct tq_live tq_live; typedef struct tq_sound tq_sound;",
                declarations(KERNEL),
                declarations(LATTICE),
                voice[0],
                declarations(LIVE),
                declarations(SOUND),
            )
        )
    )
    headers = (KERNEL, LATTICE, PLAYER, LIVE, SOUND)
    builder.set_source(
        "rig.live._live",
        f'#include "{SOUND.name}"',
        include_dirs=[str(PLAYER.parent), str(SOUND.parent)],
        depends=[str(header) for header in headers],
        extra_compile_args=COMPILER_ARGUMENTS,
        optional=True,  # no compiler: everything but a live rig works
    )
    return builder


live = live_binding()
