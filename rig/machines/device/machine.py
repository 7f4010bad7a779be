"""The cable device as a machine that boards can be."""

from __future__ import annotations

from pathlib import Path

import tactileq.modeling.rendering
import tactileq.rig.machines.force
from tactileq.rig.machines.board.emulating import Machine
from tactileq.rig.machines.device.virtual import compiled_device

CABLE_DEVICE = Machine(
    process="tactileq.rig.machines.device.process",
    folders=(
        Path(__file__).parent,
        Path(tactileq.rig.machines.force.__file__).parent,
        Path(tactileq.modeling.rendering.__file__).parent,
    ),
    macros=(),
    compiled=compiled_device,
)
