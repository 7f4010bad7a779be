"""A rig file with the stand-in of a force device, for tests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tactileq.rig.machines.force.standin import StandIn
from tactileq.rig.shared.setup.rig_file import RigFile
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


@contextmanager
def standing_in(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    """The stand-in's device, which the processes of this test open.

    Its hand has come down and rests. One that still falls swings 8 mm deep: a wall that is shown at
    that moment is not felt before the tool is lifted.
    """
    patch.setenv("TACTILEQ_STANDIN", str(folder / "device"))
    with StandIn(folder / "device") as made:
        made.fields.began_s -= 2
        made.fields.position[2] = -made.fields.press
        yield made
