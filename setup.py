"""The rooms as one package, and the C parts; without a compiler it goes on without these.

The rooms are folders at the top of the repository, and imported as `tactileq.ROOM`. So the folder
tactileq/ gets a link to each: then Python, setuptools, type checkers and editors all find one
package in the ordinary place, with no setting of theirs, and a new file needs no new installation.
The links are not committed, because Git on Windows makes text files of them.
"""

import os
import sys
from pathlib import Path

import numpy
from setuptools import Extension, setup

ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "benches")

PARTS = (
    "kernel",
    "kernel_single",
    "many",
    "slopes",
    "rivals",
    "live",
    "standin",
    "device",
    "recorder",
)

ABI = "0x030B0000"  # the stable interface as of Python 3.11: one wheel for all later ones


def link_rooms(top: Path) -> None:
    """Lay the links that are missing; on Windows junctions, which anybody may make."""
    for room in ROOMS:
        link = top / "tactileq" / room
        if link.resolve() == top / room:
            continue
        if os.path.lexists(link):  # of a checkout that was moved
            os.rmdir(link) if sys.platform == "win32" else link.unlink()
        if sys.platform == "win32":
            from _winapi import CreateJunction

            CreateJunction(str(top / room), str(link))
        else:
            link.symlink_to(Path("..", room), target_is_directory=True)


link_rooms(Path(__file__).resolve().parent)
setup(
    cffi_modules=[f"tools/c_parts.py:{part}" for part in PARTS],
    ext_modules=[
        Extension(
            "tactileq.modeling.rendering._call",
            ["modeling/rendering/call.c"],
            include_dirs=[numpy.get_include()],
            define_macros=[("Py_LIMITED_API", ABI)],
            extra_compile_args=["-std=c99", "-O2"],
            py_limited_api=True,
            optional=True,
        )
    ],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
