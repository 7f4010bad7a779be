"""Plays a steady signal and waits to be killed; says which process plays."""

from __future__ import annotations

import time

import numpy as np

from modeling.rendering.limits import Limits
from rig.live.memory import Live
from rig.sound.output import SoundOutput

live = Live.create()
limits = Limits(peak=10.0)
sound = SoundOutput(
    live, device="system", rate_hz=48000, block=128, fullscale_per_g=0.05, limits=limits
)
sound.open()
sound.play_signal(np.ones(60 * 48000))
print(sound.pid, flush=True)
time.sleep(60)
