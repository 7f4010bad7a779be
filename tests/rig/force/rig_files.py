"""A rig file with the stand-in of a force device, for tests."""

from __future__ import annotations

from pathlib import Path

from rig.setup.rig_file import RigFile
from tests.rig.desk.rig_files import rig_file

# As late as the watchdog allows: on a loaded machine an ordinary process is late, too.
FORCE = """[force]
library = "stand-in"
damping = { value = 2.0, unit = "N·s/m", assumed = true, source = "simulated" }
late_ms = { value = 19.0, unit = "ms", assumed = true, source = "a test" }
[latency]"""


def force_rig(folder: Path, *changes: tuple[str, str]) -> RigFile:
    """A rig with the stand-in as its hand, calibrated, with these changes."""
    given = (('kind = "scripted"', 'kind = "force"'), ("[latency]", FORCE))
    return rig_file(folder, *given, *changes)
