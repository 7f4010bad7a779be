"""Processor time of audio blocks and the effect of a busy session: two ways to play under a hand.

Simulated: JACK's dummy driver instead of a sound card, a planted texture (wall paper), a hand that
strokes to and fro. *C callback*: `tactileq.rig.devices.sound`, a process of its own. *Python
callback*: what one would write with sounddevice alone, `Renderer.render` in a callback of the
session's process. In the second half of each run the session holds Python's lock for 0.8 s, as a
slow page or a garbage collection may; after a second without it the rig would fall silent. A bare
process that only sleeps until each block is due shows what the machine itself misses.

Example: python docs/studies/live_study.py writes live_study.tsv beside this file and prints it.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tactileq.modeling import Renderer
from tactileq.modeling.rendering.limits import Limits
from tactileq.rig.devices.sound.output import SoundOutput
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.memory import UNDERFLOW, Live
from tactileq.stimuli.planted.textures import planted_texture

RATE_HZ = 48000
BLOCKS = (64, 128, 256)
SECONDS = 20.0
HELD_S = 0.8
LOOK_S = 0.1
LIMITS = Limits(peak=5.0, rms=2.0, duration_s=3600.0)
TEXTURE = "wall paper"
SERVER = "tactileq-study"


def stroke(at_s: float) -> tuple[float, float]:
    """Speed (mm/s) and force (N) at a moment."""
    return 200 * float(np.sin(2 * np.pi * at_s)), 1.5


def hold_lock(seconds: float) -> None:
    """Block while holding Python's global interpreter lock."""
    ctypes.PyDLL(None).usleep(int(seconds * 1e6))


def hand_in_its_process(path: str) -> None:
    """Write readings every 2 ms until this process is killed."""
    live = Live.attach(path)
    while True:
        now = now_s()
        speed, force = stroke(now)
        live.write_reading(now, 0.0, y_mm=0.0, speed_mm_s=speed, force_n=force, flags=1)
        time.sleep(0.002)


def calm_and_held(
    seconds: float, look: Callable[[], object] = lambda: None
) -> tuple[float, float, float]:
    """Wait half of the time; then hold the lock once. When that was, and when all ended."""
    wait(seconds / 2, look)
    began_s = now_s()
    hold_lock(HELD_S)
    held_until_s = now_s()
    wait(seconds / 2 - HELD_S, look)
    return began_s, held_until_s, now_s()


def wait(seconds: float, look: Callable[[], object]) -> None:
    """Wait, and look ten times a second."""
    end_s = now_s() + seconds
    while now_s() < end_s:
        look()
        time.sleep(LOOK_S)


def in_c(block: int, seconds: float) -> dict[str, Any]:
    """Our process: times and misses by its own log."""
    with Live.create() as live:
        command = [sys.executable, __file__, "--hand", str(live.path)]
        hand = subprocess.Popen(command)
        while live.latest() is None:
            time.sleep(0.01)
        sound = SoundOutput(
            live, device="system", rate_hz=RATE_HZ, block=block, fullscale_per_g=0.1, limits=LIMITS
        )
        with sound:
            sound.play(planted_texture(TEXTURE))
            began = live.blocks_written
            held = calm_and_held(seconds, sound.faults)
            _, rows = live.blocks_since(began)
        hand.kill()
        hand.wait()
    underflow = (rows["flags"] & UNDERFLOW) > 0
    return summed(rows["time_s"], rows["seconds"], underflow, block=block, held=held)


def in_python(block: int, seconds: float) -> dict[str, Any]:
    """The rival: a callback in Python, in this process."""
    import sounddevice

    renderer = Renderer(planted_texture(TEXTURE), rate_hz=RATE_HZ, limits=LIMITS)
    rows: list[tuple[float, float, bool]] = []
    rendered = np.empty(block, dtype=np.float32)

    def callback(out: Any, frames: int, times: object, status: Any) -> None:
        began_s = now_s()
        renderer.render(*stroke(began_s), out=rendered)
        out[:, 0] = rendered * np.float32(0.1)
        out[:, 1] = 0
        rows.append((began_s, now_s() - began_s, bool(status.output_underflow)))

    stream = sounddevice.OutputStream(
        device="system",
        samplerate=RATE_HZ,
        blocksize=block,
        channels=2,
        latency="low",
        callback=callback,
    )
    with stream:
        time.sleep(0.5)
        rows.clear()
        held = calm_and_held(seconds)
    times = np.array([(at, took) for at, took, _ in rows])
    missed = np.array([missed for _, _, missed in rows])
    return summed(times[:, 0], times[:, 1], missed, block=block, held=held)


def bare(block: int, seconds: float) -> int:
    """Wake-ups that a process which does nothing else missed, per minute."""
    period_s, missed = block / RATE_HZ, 0
    due_s = time.monotonic()
    end_s = due_s + seconds
    while due_s < end_s:
        due_s += period_s
        time.sleep(max(0.0, due_s - time.monotonic()))
        over = max(0, int((time.monotonic() - due_s) / period_s))
        missed += over
        due_s += over * period_s
    return round(missed * 60 / seconds)


def summed(
    at_s: Any, took_s: Any, missed: Any, *, block: int, held: tuple[float, float, float]
) -> dict[str, Any]:
    """One row: shares of a block's time, misses a minute, and blocks while the lock was held."""
    began_s, until_s, end_s = held
    period_s = block / RATE_HZ
    calm = (at_s < began_s) | ((at_s > until_s + 0.5) & (at_s < end_s))
    minutes = np.count_nonzero(calm) * period_s / 60
    meanwhile = np.count_nonzero((at_s > began_s) & (at_s < until_s))
    shares = took_s[calm] / period_s
    return {
        "block_samples": block,
        "median_us": 1e6 * float(np.median(took_s[calm])),
        "share_median": float(np.median(shares)),
        "share_p999": float(np.quantile(shares, 0.999)),
        "misses_per_min": round(float(np.count_nonzero(missed[calm]) / minutes)),
        "blocks_while_held_share": float(meanwhile * period_s / (until_s - began_s)),
    }


def measured(way: str, block: int, seconds: float) -> dict[str, Any]:
    """One run in a process of its own: PortAudio looks for servers once."""
    command = [sys.executable, __file__, "--run", way, "--block", str(block)]
    command += ["--seconds", str(seconds)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return {"callback": way, **json.loads(done.stdout.splitlines()[-1])}


def study(seconds: float) -> pd.DataFrame:
    """All blocks, both ways, each with an audio server of its own."""
    os.environ |= {"JACK_DEFAULT_SERVER": SERVER, "JACK_NO_START_SERVER": "1"}
    rows = []
    for block in BLOCKS:
        command = f"jackd --no-realtime -n {SERVER} -d dummy -r {RATE_HZ} -p {block}".split()
        server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait = ["jack_wait", "-s", SERVER, "-w", "-t", "20"]
            subprocess.run(wait, check=True, capture_output=True)
            rows += [measured(way, block, seconds) for way in ("C", "Python")]
        finally:
            server.terminate()
            server.wait()
        rows[-1]["bare_misses_per_min"] = rows[-2]["bare_misses_per_min"] = bare(block, seconds)
    return pd.DataFrame(rows)


def main() -> None:
    """The study, or one run of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--run", choices=("C", "Python"))
    parser.add_argument("--block", type=int, default=128)
    parser.add_argument("--hand")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".tsv"))
    given = parser.parse_args()
    if given.hand:
        hand_in_its_process(given.hand)
    if given.run:
        run = in_c if given.run == "C" else in_python
        print(json.dumps(run(given.block, given.seconds)))
        return
    table = study(given.seconds)
    table.to_csv(given.out, sep="\t", index=False, float_format="%.4g")
    print(table.to_string(index=False, float_format=lambda value: f"{value:.4g}"))


if __name__ == "__main__":
    main()
