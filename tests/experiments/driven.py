"""Programs that show windows for tests: one process each, since PsychoPy takes seconds to start."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]


class Driven:
    """A script that opens a window for each line of its standard input, on this display.

    It is begun with the first window, and again where a test left one open.
    """

    def __init__(self, script: Path, *, display: str) -> None:
        self.environment = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)}
        self._script = script
        self._program: subprocess.Popen[str] | None = None

    @contextmanager
    def window(self, order: str) -> Iterator[subprocess.Popen[str]]:
        """The program, which has been told of the window; the block ends when that is closed."""
        if self._program is None:
            self._program = subprocess.Popen(
                [sys.executable, str(self._script)],
                env=self.environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        try:
            self._program.stdin.write(order + "\n")
            self._program.stdin.flush()
            yield self._program
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        if self._program is not None:
            self._program.kill()
            self._program.communicate(timeout=500)
        self._program = None
