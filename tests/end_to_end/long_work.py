"""Two workers that say who they are, work for long, and would then write; ends by signals."""

from __future__ import annotations

import os
import sys
import time
from functools import partial
from pathlib import Path

from tactileq.interruption import ended_by_signals
from tactileq.workers import working


def work(name: str, *, folder: Path) -> str:
    """Write who works, and after a while that it is done."""
    (folder / f"{name}.pid").write_text(str(os.getpid()))
    time.sleep(2)
    (folder / f"{name}.done").write_text("written by a worker")
    return name


if __name__ == "__main__":
    with (
        ended_by_signals(),
        working(partial(work, folder=Path(sys.argv[1])), ("a", "b"), jobs=2) as results,
    ):
        list(results)
