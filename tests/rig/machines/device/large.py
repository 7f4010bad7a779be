"""The large numbers: `python -m tests.rig.machines.device.large` (about five minutes)."""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path

from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tests.rig.machines.device.compiled import compiled_walks
from tests.rig.machines.device.killing import ticks_after_kill
from tests.rig.machines.device.talking import Talk

KILLS = 100
BENCH_S = 120.0


def main() -> None:
    """Print what each of them found."""
    with tempfile.TemporaryDirectory() as folder:
        checked = compiled_walks(Path(folder), checked=True)
        subprocess.run([checked, "damaged", "17", "11000000"], check=True)
        fast = compiled_walks(Path(folder))
        subprocess.run([fast, "paths", "5"], check=True)
        subprocess.run([fast, "limits", "23", "100000000"], check=True)
        subprocess.run([fast, "silences", "10000"], check=True)
    talk = Talk()
    talk.push()
    begun_s = time.perf_counter()
    talk.run(BENCH_S)
    faster = BENCH_S / (time.perf_counter() - begun_s)
    print(f"simulated device: {faster:.0f} x real time, {faster * TICK_HZ:.3g} ticks/s")
    with Emulator("process", CABLE_DEVICE) as device:
        ticks = [ticks_after_kill(device.address, seed) for seed in range(KILLS)]
    print(f"kills {KILLS} shortest {min(ticks)} longest {max(ticks)}")


if __name__ == "__main__":
    main()
