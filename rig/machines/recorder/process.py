"""An emulated recorder: `python -m tactileq.rig.machines.recorder.process process BAUD PORT`.

It prints where it is reached, as `tactileq.rig.machines.device.process` does.
"""

from __future__ import annotations

import signal
import sys

from tactileq.rig.machines.device.process import new_entropy, run_board
from tactileq.rig.machines.device.virtual import VirtualBoard
from tactileq.rig.machines.recorder.virtual import compiled_recorder


def main() -> None:
    """Run it until the input ends."""
    baud, port = int(sys.argv[2]), int(sys.argv[3])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the input's end is what ends it
    board = VirtualBoard(entropy=new_entropy(), baud=baud, module=compiled_recorder())
    run_board(board, port)


if __name__ == "__main__":
    main()
