"""The C parts, built by the ordinary install; without a compiler it goes on without them."""

import numpy
from setuptools import Extension, setup

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

setup(
    cffi_modules=[f"tools/c_parts.py:{part}" for part in PARTS],
    ext_modules=[
        Extension(
            "modeling.rendering._call",
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
