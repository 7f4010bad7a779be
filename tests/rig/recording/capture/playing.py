"""A process that plays a file of samples (npy, float32) once it reads a line; for the tests."""

from __future__ import annotations

import sys

import numpy as np
import sounddevice

samples = np.load(sys.argv[1])
place = 0
go = False


def callback(data, frames, time, status) -> None:
    global place
    data[:] = 0
    if go:
        part = samples[place : place + frames]
        data[: part.size, 0] = part
        place += part.size


with sounddevice.OutputStream(samplerate=48000, channels=1, dtype="float32", callback=callback):
    print("ready", flush=True)
    sys.stdin.readline()
    go = True
    while place < samples.size:
        sounddevice.sleep(10)
    sounddevice.sleep(300)
print("played", flush=True)
