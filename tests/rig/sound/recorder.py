"""Records two channels to FILE at RATE and BLOCK until its own input ends."""

from __future__ import annotations

import sys

import numpy as np
import sounddevice

blocks: list[np.ndarray] = []
stream = sounddevice.InputStream(
    device="system",
    samplerate=float(sys.argv[2]),
    blocksize=int(sys.argv[3]),
    channels=2,
    callback=lambda data, frames, times, status: blocks.append(data.copy()),
)
stream.start()
print("ready", flush=True)
sys.stdin.read()
stream.stop()
stream.close()
np.save(sys.argv[1], np.concatenate(blocks))
