"""A session that plays a steady signal and looks after it; says which process plays, and where.

To a line "play" it plays anew, to "hang" it says so and hangs; faults it writes, a line each.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from tactileq.modeling.rendering.limits import Limits
from tactileq.rig.devices.sound.output import SoundOutput
from tactileq.rig.shared.live.clock import readable
from tactileq.rig.shared.live.memory import Live

SIGNAL_G = np.ones(60 * 48000)

live = Live.create()
limits = Limits(peak=10.0)
sound = SoundOutput(
    live, device="system", rate_hz=48000, block=128, fullscale_per_g=0.05, limits=limits
)
sound.open()
sound.play_signal(SIGNAL_G)
print(json.dumps({"sound": sound.pid, "live": str(live.path)}), flush=True)
while True:
    if readable(0, 0.05)[0]:
        line = sys.stdin.readline().strip()
        if line == "play":
            sound.play_signal(SIGNAL_G)
        elif line == "hang":
            print("hangs", flush=True)
            time.sleep(600)
    for fault in sound.faults():
        print(fault, flush=True)
