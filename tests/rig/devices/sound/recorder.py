"""Records two channels to FILE at RATE and BLOCK until its own input ends; PACED (1): no faster
than in real time, which is what a server that runs free then keeps to."""

from __future__ import annotations

import sys
import time

import numpy as np
import sounddevice

blocks: list[np.ndarray] = []
path, rate_hz, block, paced = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), sys.argv[4] == "1"
due_s = 0.0


def take(data: np.ndarray, frames: int, times: object, status: object) -> None:
    global due_s
    blocks.append(data.copy())
    if paced:
        due_s = max(due_s + frames / rate_hz, time.monotonic())
        time.sleep(max(0.0, due_s - time.monotonic()))


stream = sounddevice.InputStream(
    device="system", samplerate=rate_hz, blocksize=block, channels=2, callback=take
)
stream.start()
print("ready", flush=True)
sys.stdin.read()
stream.stop()
stream.close()
np.save(path, np.concatenate(blocks))
