"""How long a hand still feels something after a part of the desk rig fails: the fault matrix.

In software: JACK's dummy driver instead of a sound card, a planted texture, a serial sensor at a
pseudo-terminal that moves steadily at 100 mm/s. A session in its own process presents the texture
and reads the rig every 20 ms; after half a second to a second one thing fails. Another client of
the server listens to what the card would get. A run's time is from the fault to the first silent
block that it gets, after which it is silent for 0.3 s at least (a lost reader of the hand is
replaced later); none where no more blocks come.

Example: python docs/studies/faults_study.py writes faults_study.tsv beside this file and prints it.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pandas as pd

from tactileq.modeling.seeds import generator
from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.devices.hand.serial_line import SensorLine, encode
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE, RigFile
from tactileq.stimuli.planted.textures import planted_texture

RATE_HZ, BLOCK = 48000, 128
BLOCK_S = BLOCK / RATE_HZ
REPEATS = 6
WATCHED_S = 1.6
SILENT_S = 0.3
SPEED_MM_S, LINE_S = 100, 0.002
TEXTURE = "wall paper"
SERVER = "tactileq-faults"


# --- Processes of this study ----------------------------------------------------------------------


def session(rig_file: Path) -> None:
    """Present a texture and keep its session alive, until ordered to hang or killed."""
    with DeskRig(RigFile.load(rig_file)) as rig:
        rig.present_model(planted_texture(TEXTURE))
        pids = {"main": os.getpid(), "sound": rig.parts.sound.pid, "hand": rig.parts.reader.pid}
        print(json.dumps(pids), flush=True)
        while not select.select([sys.stdin], [], [], 0.02)[0]:
            rig.read()
            rig.take_faults()
        time.sleep(60)


def listen(target: Path) -> None:
    """Log when each block came and its largest sample, until the input ends."""
    import sounddevice

    heard: list[tuple[float, float]] = []
    stream = sounddevice.InputStream(
        device="system",
        samplerate=RATE_HZ,
        blocksize=BLOCK,
        channels=1,
        callback=lambda data, *_: heard.append((now_s(), float(np.abs(data).max()))),
    )
    stream.start()
    print("ready", flush=True)
    sys.stdin.read()
    np.save(target, np.array(heard))
    os._exit(0)  # closing a stream hangs where its server has died


def begun(*words: object) -> subprocess.Popen[str]:
    """This file as another process, once it has written its first line."""
    command = [sys.executable, __file__, *map(str, words)]
    pipes: dict[str, Any] = dict.fromkeys(("stdin", "stdout"), subprocess.PIPE)
    return subprocess.Popen(command, text=True, **pipes)


class Board:
    """A micro-controller that reports its position every 2 ms through a pseudo-terminal."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._frozen = Event()
        self._thread = Thread(target=self._send, daemon=True)
        self._thread.start()

    def _send(self) -> None:
        began_s = now_s()
        for number in count():
            if self._frozen.wait(max(0.0, began_s + number * LINE_S - now_s())):
                return
            moved = (round(1e3 * SPEED_MM_S * LINE_S * number), 0)
            time_us = round(1e6 * LINE_S * number)
            line = SensorLine(number % 2**16, time_us, moved, 1500, contact=True, button=False)
            with suppress(BlockingIOError):
                os.write(self._master, encode(line))

    def freeze(self) -> None:
        """Send no more."""
        self._frozen.set()
        self._thread.join()

    def unplug(self) -> None:
        """Unplug it."""
        self.freeze()
        for end in (self._master, self._slave):
            with suppress(OSError):
                os.close(end)


# --- One run --------------------------------------------------------------------------------------


class Running:
    """A session that plays, and what can be done to it."""

    def __init__(
        self, server: subprocess.Popen[bytes], board: Board, main: subprocess.Popen[str]
    ) -> None:
        self.server, self.board, self._main = server, board, main
        assert main.stdout is not None
        self._pids: dict[str, int] = json.loads(main.stdout.readline())

    def send(self, process: str, number: signal.Signals) -> None:
        """A signal to one of its processes."""
        os.kill(self._pids[process], number)

    def hang(self) -> None:
        """Let its loop hang."""
        assert self._main.stdin is not None
        self._main.stdin.write("\n")
        self._main.stdin.flush()

    def end(self) -> None:
        """End all of it."""
        for process in self._pids:
            with suppress(ProcessLookupError):
                self.send(process, signal.SIGKILL)
        self._main.communicate()
        self.board.unplug()


def sent(process: str, number: signal.Signals) -> Callable[[Running], None]:
    """The fault that is a signal to a process."""
    return lambda running: running.send(process, number)


FAULTS: dict[str, Callable[[Running], None]] = {
    "session: SIGKILL": sent("main", signal.SIGKILL),
    "session: SIGSTOP": sent("main", signal.SIGSTOP),
    "session: its loop hangs": Running.hang,
    "sound: SIGKILL": sent("sound", signal.SIGKILL),
    "sound: SIGSTOP": sent("sound", signal.SIGSTOP),
    "hand: SIGKILL": sent("hand", signal.SIGKILL),
    "hand: SIGSTOP": sent("hand", signal.SIGSTOP),
    "cable of the sensor pulled": lambda running: running.board.unplug(),
    "board of the sensor frozen": lambda running: running.board.freeze(),
    "audio server: SIGKILL": lambda running: running.server.kill(),
}


@contextmanager
def audio_server() -> Iterator[subprocess.Popen[bytes]]:
    """One without a card."""
    command = f"jackd --no-realtime -n {SERVER} -d dummy -r {RATE_HZ} -p {BLOCK}".split()
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait = ["jack_wait", "-s", SERVER, "-w", "-t", "20"]
        subprocess.run(wait, check=True, capture_output=True)
        yield server
    finally:
        server.terminate()
        server.wait()


def rig_text(board: Board) -> str:
    """The shipped rig with a serial sensor, on a dummy sound card."""
    lines = SHIPPED_RIG_FILE.read_text(encoding="utf-8").splitlines()
    kept = "\n".join(line for line in lines if not line.startswith("pressure_curve"))
    kept = kept.replace('kind = "tablet"', f'kind = "serial"\ndevice = "{board.path}"')
    return kept.replace("simulated = false", "simulated = true").replace("desk rig", SERVER)


def port(part: str) -> str:
    """The first port of the server with this in its name, but the card's own."""
    end_s = now_s() + 20
    while now_s() < end_s:
        listed = subprocess.run(["jack_lsp"], capture_output=True, text=True).stdout.split()
        found = [name for name in listed if part in name and not name.startswith("system:")]
        if found:
            return found[0]
        time.sleep(0.05)
    raise TimeoutError(f"expected a port {part} of the audio server within 20 s, got none.")


def run(fault: str, folder: Path, *, wait_s: float) -> float:
    """Milliseconds from the fault to silence."""
    with audio_server() as server:
        board = Board()
        (folder / "rig.toml").write_text(rig_text(board), encoding="utf-8")
        running = Running(server, board, begun("--session", folder / "rig.toml"))
        listener = begun("--listen", folder / "heard.npy")
        try:
            assert listener.stdout is not None
            listener.stdout.readline()
            subprocess.run(["jack_connect", port(":out_"), port(":in_")], check=True)
            time.sleep(wait_s)
            failed_s = now_s()
            FAULTS[fault](running)
            time.sleep(WATCHED_S)
            listener.communicate()
        finally:
            running.end()
            listener.kill()
    return 1e3 * (silent_at_s(np.load(folder / "heard.npy"), failed_s) - failed_s)


def silent_at_s(heard: Any, failed_s: float) -> float:
    """When the first silent block came; the (n, 2) blocks are times and peaks.

    Infinite where it vibrated on, NaN where no more blocks came.
    """
    times_s, is_loud = heard[:, 0], heard[:, 1] > 0
    if not np.mean(is_loud[times_s < failed_s][-100:]) > 0.5:  # a loaded machine loses some blocks
        raise ValueError("expected vibration before the fault, got silence.")
    loud_s = times_s[is_loud]
    is_over = loud_s[-1] < failed_s + WATCHED_S - SILENT_S
    ends_s = loud_s[np.append(np.diff(loud_s) > SILENT_S, is_over)]
    ends_s = ends_s[ends_s > failed_s - SILENT_S]
    if not ends_s.size:
        return float("inf")
    silent_s = times_s[~is_loud & (times_s > ends_s[0])]
    return max(float(silent_s[0]), failed_s) if silent_s.size else float("nan")


# --- All of it ------------------------------------------------------------------------------------


def study(repeats: int) -> pd.DataFrame:
    """All faults, in turn, so often."""
    os.environ |= {"JACK_DEFAULT_SERVER": SERVER, "JACK_NO_START_SERVER": "1"}
    waits = generator(0).uniform(0.5, 1.0, size=(repeats, len(FAULTS)))
    taken: dict[str, list[float]] = {fault: [] for fault in FAULTS}
    with tempfile.TemporaryDirectory() as folder:
        for row in waits:
            for fault, wait_s in zip(FAULTS, row, strict=True):
                taken[fault].append(run(fault, Path(folder), wait_s=float(wait_s)))
                print(f"{fault}: {taken[fault][-1]:.0f} ms", file=sys.stderr)
    return pd.DataFrame(
        {
            "fault": list(taken),
            "n": [len(times) for times in taken.values()],
            "median_ms": [float(np.median(times)) for times in taken.values()],
            "worst_ms": [max(times) for times in taken.values()],
        }
    )


def main() -> None:
    """The study, or one of its processes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=REPEATS)
    parser.add_argument("--session", type=Path)
    parser.add_argument("--listen", type=Path)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".tsv"))
    given = parser.parse_args()
    if given.session:
        session(given.session)
        return
    if given.listen:
        listen(given.listen)
        return
    table = study(given.repeats)
    table.to_csv(given.out, sep="\t", index=False, float_format="%.0f", na_rep="n/a")
    print(table.to_string(index=False, float_format=lambda value: f"{value:.0f}"))


if __name__ == "__main__":
    main()
