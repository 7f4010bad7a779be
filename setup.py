"""The C parts, built by the ordinary install; without a compiler it goes on without them."""

import numpy
from setuptools import Extension, setup

PARTS = ("kernel", "kernel_single", "many", "slopes", "rivals", "live")

setup(
    cffi_modules=[f"tools/c_parts.py:{part}" for part in PARTS],
    ext_modules=[
        Extension(
            "modeling.rendering._call",
            ["modeling/rendering/call.c"],
            include_dirs=[numpy.get_include()],
            extra_compile_args=["-std=c99", "-O2"],
            optional=True,
        )
    ],
)
