"""The process of an emulated device (rig/machines/board/process.py)."""

from __future__ import annotations

from tactileq.rig.machines.board.process import emulate
from tactileq.rig.machines.device.virtual import compiled_device

if __name__ == "__main__":
    emulate(compiled_device)
