"""The process of an emulated recorder (rig/machines/board/process.py)."""

from __future__ import annotations

from tactileq.rig.machines.board.process import emulate
from tactileq.rig.machines.recorder.virtual import compiled_recorder

if __name__ == "__main__":
    emulate(compiled_recorder)
