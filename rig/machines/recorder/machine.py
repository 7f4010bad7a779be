"""The recorder as a machine that boards can be."""

from __future__ import annotations

from pathlib import Path

import tactileq.rig.machines.force
from tactileq.rig.machines.board.emulating import Machine
from tactileq.rig.machines.recorder.virtual import compiled_recorder

SURFACE_RECORDER = Machine(
    process="tactileq.rig.machines.recorder.process",
    folders=(Path(__file__).parent, Path(tactileq.rig.machines.force.__file__).parent),
    macros=("TQ_RECORDER",),
    compiled=compiled_recorder,
)
