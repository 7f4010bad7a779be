"""From a hand's reading to the block in which another program gets the first sample of it.

Simulated: JACK's dummy driver instead of a sound card, a hand that steps from rest to a stroke. The
recorder is a client of the same server. Conversion, amplifier and vibrator are not in it; `tactileq
rig latency` measures those at a rig. The server must run; see `live_study.py`, which starts it.

Example: python docs/studies/live_latency_study.py --steps 200
"""

from __future__ import annotations

import argparse
import subprocess
import time
from typing import Any

import numpy as np
import sounddevice

from tactileq.modeling.rendering.limits import Limits
from tactileq.rig.devices.sound.output import SoundOutput
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.memory import Live
from tactileq.stimuli.planted.textures import planted_texture

RATE_HZ, BLOCK = 48000, 128
REST_S, STROKE_S = 0.12, 0.05


def ports(kind: str) -> list[str]:
    """Names of the ports of programs."""
    listed = subprocess.run(["jack_lsp"], capture_output=True, text=True, check=True).stdout
    return sorted(name for name in listed.split() if kind in name and "PortAudio" in name)


def hold(live: Live, speed: float, seconds: float) -> float:
    """A hand of this speed for so long, a reading every 2 ms; when its first one was written."""
    began_s = now_s()
    while now_s() - began_s < seconds:
        live.heartbeat()
        live.write_reading(
            now_s(), 0.0, y_mm=0.0, speed_mm_s=speed, force_n=1.5 * (speed > 0), flags=1
        )
        time.sleep(0.002)
    return began_s


def main() -> None:
    """Print median and 95th percentile."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=200)
    steps = parser.parse_args().steps
    heard: list[float] = []
    was_silent = [True]

    def callback(data: Any, frames: int, times: object, status: object) -> None:
        sounds = bool(data[:, 0].any())
        if sounds and was_silent[0]:
            heard.append(now_s())
        was_silent[0] = not sounds

    limits = Limits(peak=5.0)
    with Live.create() as live:
        hold(live, 0.0, 0.01)
        sound = SoundOutput(
            live, device="system", rate_hz=RATE_HZ, block=BLOCK, fullscale_per_g=0.1, limits=limits
        )
        with sound:
            played = ports(":out_")[0]
            stream = sounddevice.InputStream(
                device="system", samplerate=RATE_HZ, blocksize=BLOCK, channels=1, callback=callback
            )
            with stream:
                subprocess.run(["jack_connect", played, ports(":in_")[0]], check=True)
                hold(live, 0.0, 0.3)
                sound.play(planted_texture("wall paper"))
                hold(live, 0.0, REST_S)
                heard.clear()
                stepped = []
                for _ in range(steps):
                    stepped.append(hold(live, 200.0, STROKE_S))
                    hold(live, 0.0, REST_S)
    delays = [
        1e3 * (min(at for at in heard if at > step) - step)
        for step in stepped
        if any(step < at < step + STROKE_S for at in heard)
    ]
    print(
        f"{len(delays)} of {steps} steps captured: median {np.median(delays):.1f} ms, "
        f"95 % within {np.quantile(delays, 0.95):.1f} ms"
    )


if __name__ == "__main__":
    main()
