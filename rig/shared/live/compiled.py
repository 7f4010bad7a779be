"""The compiled parts of a rig: its clock, its memory, what plays and what pushes."""

from __future__ import annotations

import os
from typing import Any

from tactileq.modeling.errors import InputError

CLOCK = "TACTILEQ_CLOCK"  # the file of a clock that is given to this process (clock.h)

try:
    import tactileq.rig.shared.live._live as _live
except ImportError:  # no compiler at installation
    _live = None
else:
    if CLOCK in os.environ:
        _live.lib.tq_clock_take(os.fsencode(os.environ[CLOCK]))


def is_compiled() -> bool:
    """Whether there are any."""
    return _live is not None


def compiled() -> Any:
    """The module of the compiled parts.

    Raises
    ------
    InputError
        If there is none: nothing in Python keeps the time of an audio callback.
    """
    if _live is None:
        raise InputError(
            "expected the compiled parts of tactileq, which a rig needs, got none; install a C "
            "compiler (gcc or clang), then tactileq again."
        )
    return _live
