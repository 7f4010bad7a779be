"""Which engine computes: the compiled parts, or Python with the same results."""

from __future__ import annotations

import os

# Set to anything, computes in Python although the compiled parts are there.
SWITCH = "TACTILEQ_NO_KERNEL"


def prefers_python() -> bool:
    """Whether Python is asked for by `SWITCH`."""
    return bool(os.environ.get(SWITCH))
