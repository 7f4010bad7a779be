"""The C parts, built by the ordinary install; without a compiler it goes on without them."""

from setuptools import setup

setup(cffi_modules=["tools/c_parts.py:kernel", "tools/c_parts.py:rivals"])
