"""What is installed on request only, and the sentence where it is missing."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from tactileq.modeling.errors import InputError

Extra = Literal["console", "rig", "chart", "publish"]
CONSOLE_BEFORE = (3, 13)  # PsychoPy's own limit, in pyproject.toml as well


class MissingExtra(InputError):
    """A package that an extra installs is missing."""


@contextmanager
def extra(name: Extra) -> Iterator[None]:
    """Import within this what the extra of that name installs (pyproject.toml).

    Raises
    ------
    InputError
        Where a module is missing: which, and what to install.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtra(
            f"expected the package {error.name}, got none; {install_advice(name)}."
        ) from error


def install_advice(name: Extra) -> str:
    """How to install an extra with this Python, or with which other."""
    install = f"install the extra {name}: pip install 'tactileq[{name}]'"
    if name == "console" and sys.version_info >= CONSOLE_BEFORE:
        return f"PsychoPy needs Python 3.11 or 3.12, so with one of these {install}"
    return install
