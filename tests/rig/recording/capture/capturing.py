"""A process that records from the first input until its standard input ends, for the tests.

Arguments: where the result goes (npz), and seconds for which it once does nothing at all.
"""

from __future__ import annotations

import ctypes
import sys
import threading

import numpy as np

from tactileq.rig.recording.capture.input import AudioInput, InputSettings
from tactileq.rig.shared.live.clock import now_s


def main() -> None:
    out, stop_s = sys.argv[1], float(sys.argv[2])
    blocks = []
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.readline(), ended.set()), daemon=True).start()
    began_s = now_s()
    with AudioInput(InputSettings(g_per_fullscale=10.0)) as source:
        while not source.read():
            ended.wait(0.01)
        print("ready", flush=True)
        if stop_s:
            # Holds the interpreter's lock, so that no callback can run meanwhile.
            ctypes.PyDLL(None).usleep(round(stop_s * 1e6))
        while source.running and (len(blocks) < 20 or not ended.wait(0.02)):
            blocks += source.read()
        blocks += source.read()
        told = {"running": source.running, "rate_hz": source.rate_hz, "name": source.device_name}
    np.savez(
        out,
        samples=np.concatenate([np.zeros(0), *(block.samples for block in blocks)]),
        position=[block.position for block in blocks],
        time_s=[block.time_s for block in blocks],
        lost=[block.lost for block in blocks],
        began_s=began_s,
        ended_s=now_s(),
        **told,
    )


main()
