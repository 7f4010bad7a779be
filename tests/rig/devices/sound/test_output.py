"""The sound process, with JACK's server that has no card: bits, swaps, failures."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tactileq.modeling import InputError
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.plan import RELEASE_S
from tactileq.rig.devices.sound.output import SoundOutput
from tactileq.rig.devices.sound.supervision import SoundLost
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.live.memory import (
    BLOCK,
    CONTACT,
    GONE,
    HEARTBEAT_S,
    NO_HEARTBEAT,
    STALE,
    Live,
)
from tests.modeling.rendering.lattices import planted_ar
from tests.refusals import refused
from tests.rig.planted import planted_model as model
from tests.rig.shared.live.replay import Log, engine_of
from tests.rig.waiting import wait_until

HERE = Path(__file__).parent
RATE_HZ = 48000
FRAMES = 128  # of a block of the server here
SCALE = 0.05
LIMITS = Limits(peak=10.0, rms=5.0, duration_s=1000.0)
FADE = 240
Array = np.ndarray[Any, np.dtype[Any]]
Jack = Callable[..., AbstractContextManager[Any]]


def output(live: Live, *, block: int = 128, seed: int = 0, **more: Any) -> SoundOutput:
    settings: dict[str, Any] = {"device": "system", "limits": LIMITS, "fullscale_per_g": SCALE}
    return SoundOutput(live, rate_hz=RATE_HZ, block=block, seed=seed, **(settings | more))


class Stroker:
    """A hand that writes its readings every 2 ms: to and fro, or as told."""

    def __init__(self, live: Live, hand: Callable[[float], tuple[float, float]]) -> None:
        self._live, self.hand = live, hand
        self.stands_still = self._ends = False
        self.flags = CONTACT
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        with taking_part():
            while not self._ends:
                if not self.stands_still:
                    now = now_s()
                    speed, force = self.hand(now)
                    self._live.write_reading(
                        now, 0.0, y_mm=0.0, speed_mm_s=speed, force_n=force, flags=self.flags
                    )
                sleep(0.002)

    def end(self) -> None:
        self._ends = True
        self._thread.join()


def strokes(at_s: float) -> tuple[float, float]:
    return 200 * float(np.sin(2 * np.pi * at_s)), 1.5


def quick_strokes(at_s: float) -> tuple[float, float]:
    """For a server that runs many times as fast as the clock."""
    return strokes(30 * at_s)


@contextmanager
def stroking(live: Live, hand: Callable[[float], tuple[float, float]] = strokes) -> Iterator[Any]:
    stroker = Stroker(live, hand)
    try:
        yield stroker
    finally:
        stroker.end()


class Recorder:
    """What the card would get, both channels: a client of the same server, in its own process.

    A server that keeps real time plays on without a client that is late. Paced, the server runs
    free, so it waits for its clients, and the recorder keeps it to real time: no block is lost.
    """

    def __init__(
        self, server: Any, target: Path, *, block: int = FRAMES, paced: bool = True
    ) -> None:
        self._target, self._server, self._paced = target, server, paced
        before = set(server.ports())
        words = [str(target), str(RATE_HZ), str(block), str(int(paced))]
        self._process = subprocess.Popen(
            [sys.executable, str(HERE / "recorder.py"), *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == b"ready\n"
        mine = sorted(port for port in set(server.ports()) - before if ":in_" in port)
        played = sorted(port for port in server.ports() if ":out_" in port)
        for number, (source, port) in enumerate(zip(played, mine, strict=True), start=1):
            server.disconnect(f"system:capture_{number}", port)
            server.connect(source, port)
        if paced:
            server.freewheel(True)

    def recorded(self) -> Array:
        """(n, 2), from when it was connected on."""
        if self._paced:
            self._server.freewheel(False)
        self._process.communicate(timeout=500)
        recorded: Array = np.load(self._target)
        return recorded


@pytest.fixture
def server(jack_server: Jack) -> Iterator[Any]:
    with jack_server(block=FRAMES) as running:
        yield running


def played_freely(
    jack_server: Jack, folder: Path, made: Any, *, block: int, seconds: int
) -> tuple[Array, Array]:
    """What left, and what the log says: a presentation's samples, scaled, before its fade-in.

    Faster than real time: a second is over in 40 ms. Where a busy machine lets one of the processes
    wait for longer than a hand or a session may, it is tried again, from the server on.
    """
    for _ in range(5):
        captured, rows, number, log = freely(
            jack_server, folder, made, block=block, seconds=seconds
        )
        ours = rows[rows["presentation"] == number]
        whole = np.all(np.diff(ours["position"].astype(int)) == block)
        if whole and not np.any(rows["flags"] & (STALE | NO_HEARTBEAT)):
            break
    assert not np.any(ours["flags"] & STALE)
    assert np.ptp(ours["speed_mm_s"]) > 300
    assert np.all(np.diff(ours["position"].astype(int)) == block)
    engine = engine_of(made, RATE_HZ, block=block, seed=7, stream=number, limits=LIMITS)
    wanted = log.played(rows, number, engine).astype(np.float32) * np.float32(SCALE)
    return captured, wanted


def freely(
    jack_server: Jack, folder: Path, made: Any, *, block: int, seconds: int
) -> tuple[Array, Array, int, Log]:
    """What left, the blocks of the log, the presentation's number, and the log."""
    with (
        jack_server(block=block) as server,
        Live.create() as live,
        stroking(live, quick_strokes),
        output(live, block=block, seed=7) as sound,
    ):
        recorder = Recorder(server, folder / "captured.npy", block=block, paced=False)
        sound.play(model())  # what is done once takes its time before the server runs free
        sound.silence()
        server.freewheel(True)
        number = sound.play(made).presentation
        rows = wait_for_blocks(live, 0, seconds * RATE_HZ // block, of=number)
        log = Log(live, RATE_HZ)
        server.freewheel(False)
        return recorder.recorded()[:, 0], rows, number, log


def together(captured: Array, wanted: Array) -> tuple[Array, Array]:
    """What left from where a presentation began, and the presentation, as long as both last."""
    # The first second may be silent: on a busy machine it is over before the hand has moved.
    loud = FADE + int(np.argmax(np.abs(wanted[FADE : wanted.size // 2])))
    near = np.abs(captured - wanted[loud]) <= 1e-6 * np.abs(wanted).max()
    seen = 500  # samples from there on by which one place is told from another
    places = [at for at in np.flatnonzero(near) if loud <= at < captured.size - seen]
    off = [np.abs(captured[at : at + seen] - wanted[loud : loud + seen]).sum() for at in places]
    captured = captured[places[int(np.argmin(off))] - loud :]
    size = min(captured.size, wanted.size)
    return captured[:size], wanted[:size]


@pytest.mark.parametrize("block", [1024, 128])
def test_a_minute_leaves_with_the_bits_of_the_renderer(
    jack_server: Jack, tmp_path: Path, block: int
) -> None:
    seconds = 60 if block == 1024 else 5
    captured, wanted = played_freely(jack_server, tmp_path, model(), block=block, seconds=seconds)
    captured, wanted = together(captured, wanted)
    assert wanted.size >= (seconds - 1) * RATE_HZ
    np.testing.assert_array_equal(captured[FADE:], wanted[FADE:])
    fade = np.arange(1, FADE + 1) / FADE
    np.testing.assert_allclose(captured[:FADE], wanted[:FADE] * fade, rtol=1e-6)


def test_an_all_pole_model_leaves_as_python_filters_it(jack_server: Jack, tmp_path: Path) -> None:
    """At 48 kHz what the engine in Python makes of the readings of the log."""
    block = 1024
    captured, wanted = played_freely(jack_server, tmp_path, planted_ar(), block=block, seconds=8)
    captured, wanted = together(captured, wanted)
    assert wanted.size >= 7 * RATE_HZ
    near = 1e-6 * np.abs(wanted).max()
    np.testing.assert_allclose(captured[FADE:], wanted[FADE:], rtol=0, atol=near)


def wait_for_blocks(live: Live, before: int, count: int, *, of: int = 0) -> Array:
    """All blocks since, once so many of a presentation (from this number on) are among them.

    Who waits looks after what plays.
    """
    rows = [np.zeros(0, dtype=BLOCK)]
    end_s = now_s() + 60
    with taking_part():
        while sum(np.count_nonzero(some["presentation"] >= of) for some in rows) < count:
            assert now_s() < end_s
            live.heartbeat()
            before, more = live.blocks_since(before)
            rows.append(more)
            sleep(0.005)
    return np.concatenate(rows)


# --- Swaps, signals, masking ----------------------------------------------------------------------


def constant(at_s: float) -> tuple[float, float]:
    return 200.0, 1.5


def test_textures_are_swapped_through_silence_without_a_click(server: Any, tmp_path: Path) -> None:
    with Live.create() as live, stroking(live, constant), output(live) as sound:
        recorder = Recorder(server, tmp_path / "captured.npy")
        before = live.blocks_written
        numbers = [sound.play(model(gain)).presentation for gain in (0.2, 0.4, 0.1)]
        sleep(0.1)
        sound.silence()
        _, rows = live.blocks_since(before)
        sleep(0.05)
        captured = recorder.recorded()[:, 0] / SCALE
    assert numbers == [1, 2, 3]
    played = rows["presentation"]
    changes = np.flatnonzero(np.diff(played, prepend=np.uint32(0)))
    assert played[changes].tolist() == [1, 2, 3, 0]
    sounding = np.flatnonzero(captured)
    # Where one texture ends and the next begins, and at both ends, the level is that of a fade.
    steepest = np.abs(np.diff(captured)).max()
    edges = [sounding[0], sounding[-1]]
    assert all(abs(captured[edge]) < 0.05 * steepest for edge in edges)
    assert not captured[sounding[-1] + 1 :].any()


def test_what_presenting_returns_is_when_the_first_sample_leaves(server: Any) -> None:
    with Live.create() as live, stroking(live, constant), output(live) as sound:
        before = live.blocks_written
        asked_s = now_s()
        presented = sound.play(model())
        returned_s = now_s()
        _, rows = live.blocks_since(before)
    first = rows[rows["presentation"] == presented.presentation][0]
    assert presented.time_s == first["dac_time_s"] >= first["time_s"]
    assert asked_s < presented.time_s <= returned_s


def test_a_signal_leaves_as_it_is_and_voices_wait_for_it(server: Any, tmp_path: Path) -> None:
    tone = 2 * np.sin(2 * np.pi * 250 / RATE_HZ * np.arange(RATE_HZ // 4))
    with Live.create() as live, stroking(live, constant), output(live) as sound:
        recorder = Recorder(server, tmp_path / "captured.npy")
        sound.play(model())
        before = live.blocks_written
        first = sound.play_signal(tone, wait=True)
        second = sound.play(model())
        sound.silence()
        _, rows = live.blocks_since(before)
        captured = recorder.recorded()[:, 0]
    played = rows["presentation"]
    changes = [int(n) for n in played[np.flatnonzero(np.diff(played)) + 1]]
    assert changes[-3:] == [0, second.presentation, 0]
    assert first.presentation in changes
    wanted = tone.astype(np.float32) * np.float32(SCALE)
    # The tone begins with a zero: look for its largest sample.
    at = int(np.flatnonzero(captured == wanted[48])[0]) - 48
    assert np.array_equal(captured[at : at + wanted.size], wanted)


def test_a_signal_that_is_stopped_fades(server: Any, tmp_path: Path) -> None:
    with Live.create() as live, output(live) as sound:
        recorder = Recorder(server, tmp_path / "captured.npy")
        sound.play_signal(np.ones(RATE_HZ))
        sleep(0.05)
        sound.silence()
        sleep(0.05)
        captured = recorder.recorded()[:, 0] / np.float32(SCALE)
    sounding = np.flatnonzero(captured)
    assert sounding.size < RATE_HZ // 2
    falls = captured[sounding[-1] - FADE + 2 : sounding[-1] + 1]
    np.testing.assert_allclose(falls, np.arange(FADE - 1, 0, -1) / FADE, atol=1e-6)


def test_masking_noise_is_white_of_its_level_on_its_channel_alone(
    server: Any, tmp_path: Path
) -> None:
    with Live.create() as live, output(live, masking_channel=1) as sound:
        recorder = Recorder(server, tmp_path / "captured.npy")
        sound.masking(0.1)
        sleep(1.2)
        sound.masking(0)
        sleep(0.1)
        vibration, noise = recorder.recorded().T
    assert not vibration.any()
    sounding = np.flatnonzero(noise)
    middle = noise[sounding[0] + FADE : sounding[-1] - FADE].astype(float)
    assert middle.size > RATE_HZ // 5
    assert middle.std() == pytest.approx(0.1, rel=0.02)
    spectrum = np.abs(np.fft.rfft(middle)) ** 2
    thirds = [part.mean() for part in np.array_split(spectrum[1:], 3)]
    assert max(thirds) < 1.1 * min(thirds)
    assert not noise[sounding[-1] + 1 :].any()


def test_counters_of_the_limits_come_back_with_the_silence(server: Any) -> None:
    low = Limits(peak=0.02, rms=5.0)
    with Live.create() as live, stroking(live, constant), output(live, limits=low) as sound:
        presented = sound.play(model())
        sleep(0.2)
        counted = sound.silence()
        assert sound.silence() is not None
    assert counted is not None
    assert counted.presentation == presented.presentation
    assert counted.counters.limited_peak > 0
    assert counted.counters.limited_rms == 0


def test_limits_hold_where_a_signal_and_a_texture_follow_each_other(
    server: Any, tmp_path: Path
) -> None:
    limits = Limits(peak=10.0, rms=0.05, rms_window_s=0.2)
    signal_g = np.full(RATE_HZ // 4, 0.05)
    with (
        Live.create() as live,
        stroking(live, constant),
        output(live, limits=limits) as sound,
    ):
        recorder = Recorder(server, tmp_path / "captured.npy")
        for _ in range(2):
            sound.play_signal(signal_g, wait=True)
            sound.play(model(4.0))
            sleep(0.2)
        counted = sound.silence()
        captured = recorder.recorded()[:, 0].astype(float) / SCALE
    assert counted is not None
    assert counted.counters.limited_rms > 0
    share = -np.expm1(-1 / (0.2 * RATE_HZ))
    mean_square = lfilter([share], [1, share - 1], captured**2)
    assert 0.9 < np.sqrt(mean_square.max()) / 0.05 < 1 + 1e-5


def test_signals_one_after_the_other_are_no_longer_than_the_limit_without_a_pause(
    server: Any,
) -> None:
    """By the log of what left: a recorder loses blocks on a loaded machine."""
    limits = Limits(peak=1.0, duration_s=0.5, pause_s=0.1)
    with (
        Live.create() as live,
        stroking(live, constant),
        output(live, limits=limits) as sound,
    ):
        before = live.blocks_written
        for _ in range(5):
            sound.play_signal(np.full(RATE_HZ // 5, 0.5), wait=True)
        sound.play(model())
        sleep(0.2)
        sound.play_signal(np.full(RATE_HZ // 5, 0.5), wait=True)
        _, rows = live.blocks_since(before)
    whole = rows[rows["peak_g"] >= 0.49]["square_sum_g2"].sum()
    assert whole == pytest.approx(6 * RATE_HZ / 5 * 0.25, rel=0.05)
    felt = rows[rows["square_sum_g2"] > 0]
    # By time: in a block that was missed nothing is felt, and no sample of it is counted.
    since_s = np.diff(felt["time_s"]) - FRAMES / RATE_HZ
    runs = np.split(felt["frames"].astype(int), np.flatnonzero(since_s >= 0.1) + 1)
    assert len(runs) > 2
    assert max(run.sum() for run in runs) <= 0.5 * RATE_HZ + FRAMES


# --- What goes wrong ------------------------------------------------------------------------------


def silent_from(captured: Array) -> int:
    """The first of the zeros at the end."""
    sounding = np.flatnonzero(captured)
    return int(sounding[-1]) + 1 if sounding.size else 0


def since(live: Live, before: int) -> Array:
    """The blocks since; who asks looks after what plays."""
    live.heartbeat()
    return live.blocks_since(before)[1]


@pytest.mark.parametrize("how", ["stopped", "gone"])
def test_a_hand_that_is_old_or_gone_fades_to_silence(server: Any, tmp_path: Path, how: str) -> None:
    with Live.create() as live, stroking(live, constant) as stroker, output(live) as sound:
        recorder = Recorder(server, tmp_path / "captured.npy")
        before = live.blocks_written
        sound.play(model())
        sleep(0.1)
        if how == "stopped":
            stroker.stands_still = True
        else:
            stroker.flags = GONE
        wait_until(lambda: np.count_nonzero(since(live, before)["flags"] & STALE) > 80)
        rows = since(live, before)
        assert sound.faults() == ()
        captured = recorder.recorded()[:, 0]
    last = live_last = rows[rows["flags"] & STALE == 0][-1]
    stale = rows[rows["flags"] & STALE > 0]
    assert not stale["speed_mm_s"].any()
    assert not stale["force_n"].any()
    if how == "stopped":
        assert stale["time_s"][0] - live_last["time_s"] < 0.2  # its age was below 0.1 s there
    # From the last block with a hand on: one update, 3 ms until contact has ended and the update
    # after it, the 5 ms in which gains fall, and what is interpolated.
    ends = FRAMES + 48 + round(RELEASE_S * RATE_HZ) + 48
    lasting = FADE + round(37 * RATE_HZ / 5000) + FRAMES
    loud = rows[rows["square_sum_g2"] > 0][-1]
    assert int(loud["position"]) - int(last["position"]) <= ends + lasting
    assert silent_from(captured) < captured.size - RATE_HZ // 10


def test_a_parent_that_holds_its_lock_delays_nothing(server: Any) -> None:
    import ctypes

    with Live.create() as live, output(live) as sound:
        hand = subprocess.Popen([sys.executable, str(HERE / "hand.py"), str(live.path)])
        try:
            wait_until(lambda: live.readings_written > 0)
            sound.play(model())
            wait_for_blocks(live, live.blocks_written, 10)
            before, held_s = live.blocks_written, now_s()
            ctypes.PyDLL(None).usleep(900_000)  # with the interpreter's lock held
            freed_s = now_s()
            _, rows = live.blocks_since(before)
        finally:
            hand.kill()
            hand.wait()
    meanwhile = rows[(rows["time_s"] > held_s) & (rows["time_s"] < freed_s)]
    # Were it delayed, there would be none; a loaded machine loses most.
    assert meanwhile.size > 20
    assert np.count_nonzero(meanwhile["square_sum_g2"]) > 0.9 * meanwhile.size


@pytest.mark.parametrize(
    ("number", "why"), [(signal.SIGKILL, "it has ended"), (signal.SIGSTOP, "no block for 0.5 s")]
)
def test_a_killed_or_stopped_process_is_told_and_replaced(
    server: Any, number: signal.Signals, why: str
) -> None:
    with Live.create() as live, stroking(live, constant), output(live) as sound:
        sound.play(model())
        first = sound.pid
        assert first is not None
        os.kill(first, number)
        told: list[str] = []
        wait_until(lambda: bool(told.extend(sound.faults()) or told))
        assert len(told) == 1
        assert why in told[0]
        assert sound.faults() == ()
        assert sound.pid is None
        assert sound.silence() is None
        before = live.blocks_written
        presented = sound.play(model())
        assert sound.pid not in (first, None)
        _, rows = live.blocks_since(before)
    assert presented.presentation in rows["presentation"]


def test_a_killed_process_is_noticed_by_who_presents_next(server: Any) -> None:
    with Live.create() as live, stroking(live, constant), output(live) as sound:
        sound.play(model())
        assert sound.pid is not None
        os.kill(sound.pid, signal.SIGKILL)
        presented = sound.play(model())
        assert presented.presentation == 2
        assert len(sound.faults()) == 1


def test_a_process_that_is_killed_in_a_signal_is_told_who_waits_for_its_end(server: Any) -> None:
    with Live.create() as live, output(live) as sound:
        assert sound.pid is not None
        threading.Timer(0.3, os.kill, (sound.pid, signal.SIGKILL)).start()
        with refused(SoundLost, names="sound process"):
            sound.play_signal(np.ones(10 * RATE_HZ), wait=True)
        assert len(sound.faults()) == 1
        sound.play_signal(np.ones(100), wait=True)


def test_masking_of_a_killed_process_is_that_of_the_next(server: Any, tmp_path: Path) -> None:
    with Live.create() as live, output(live, masking_channel=1) as sound:
        assert sound.pid is not None
        os.kill(sound.pid, signal.SIGKILL)
        sound.masking(0.1)
        assert len(sound.faults()) == 1
        sound.play(model())
        sound.silence()  # the recorder takes its time, for which nobody looks after what plays
        recorder = Recorder(server, tmp_path / "captured.npy")
        sleep(0.2)
        noise = recorder.recorded()[:, 1]
    assert noise[noise != 0].std() == pytest.approx(0.1, rel=0.1)


def test_a_dead_server_is_told_within_a_second_and_nothing_hangs(jack_server: Jack) -> None:
    with jack_server(block=FRAMES) as server, Live.create() as live, stroking(live, constant):
        sound = output(live)
        sound.open()
        sound.play(model())
        server.kill()
        end = now_s() + 10
        told: tuple[str, ...] = ()
        while not told and now_s() < end:
            told = sound.faults()
            sleep(0.01)
        assert len(told) == 1
        for _ in range(2):
            with refused(SoundLost, expected="sound device", got="none"):
                sound.play(model())
            assert (sound.pid, sound.faults()) == (None, ())
        sound.close()
        assert now_s() < end + 20


class Parent:
    """A session in its own process, which plays a steady signal; see parent.py."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "parent.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        told = json.loads(self.hears())
        self.child, self.live = int(told["sound"]), Live.attach(told["live"])

    def hears(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline()

    def send(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def stop(self) -> float:
        """Stop it as Ctrl-Z or a debugger does; by when it stood."""
        self.process.send_signal(signal.SIGSTOP)
        state = Path(f"/proc/{self.process.pid}/stat")
        wait_until(lambda: state.read_text().rsplit(")", 1)[1].split()[0] == "T")
        return now_s()

    def blocks_until_silent(self, before: int) -> Array:
        """All blocks since, once the last twenty are silent."""
        rows: Array = np.zeros(0, dtype=BLOCK)
        end = now_s() + 20
        while rows.size <= 20 or rows["peak_g"][-20:].any():  # of a server that may be slow
            assert now_s() < end
            sleep(0.1)
            before, more = self.live.blocks_since(before)
            rows = np.append(rows, more)
        return rows

    def end(self) -> None:
        self.process.kill()
        self.process.communicate()
        self.live.close()


@pytest.fixture
def parent(server: Any) -> Iterator[Parent]:
    started = Parent()
    yield started
    started.end()


def check_halted(rows: Array, *, by_s: float) -> None:
    """What played until then ended a second later by a fade, and is marked since."""
    marked = (rows["flags"] & NO_HEARTBEAT) > 0
    first = int(np.argmax(marked))
    assert marked[first:].all()
    assert np.all(rows["peak_g"][:first] == 1.0)
    assert rows["time_s"][first - 1] <= by_s + HEARTBEAT_S
    fades = rows[first:][rows["peak_g"][first:] > 0]
    assert fades.size <= -(-FADE // FRAMES)
    assert not rows["peak_g"][first + fades.size :].any()


def test_a_session_that_is_stopped_or_hangs_leaves_silence_until_it_presents_again(
    parent: Parent,
) -> None:
    began_s = now_s()
    wait_until(lambda: now_s() - began_s > 3 * HEARTBEAT_S)
    _, rows = parent.live.blocks_since(0)
    playing = rows[np.argmax(rows["peak_g"] > 0) :]
    assert np.all(playing["peak_g"] == 1.0)  # polling steadily it is never halted
    before = parent.live.blocks_written
    os.kill(parent.child, signal.SIGTSTP)  # of Ctrl-Z, which is not the sound's to follow
    stopped_s = parent.stop()
    check_halted(parent.blocks_until_silent(before), by_s=stopped_s)
    before = parent.live.blocks_written
    parent.process.send_signal(signal.SIGCONT)
    assert "poll the rig" in parent.hears()
    rows = wait_for_blocks(parent.live, before, 20)
    assert not rows["peak_g"].any()  # nothing resumes by itself
    parent.send("play")
    wait_until(lambda: parent.live.blocks_since(before)[1]["peak_g"].any())
    before = parent.live.blocks_written
    parent.send("hang")
    assert parent.hears() == "hangs\n"
    hangs_s = now_s()
    check_halted(parent.blocks_until_silent(before), by_s=hangs_s)


def test_a_signal_that_was_halted_is_told_who_waits_for_its_end(
    server: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Live.create() as live, output(live) as sound:
        with monkeypatch.context() as patch:
            patch.setattr(live, "heartbeat", lambda: None)
            with refused(SoundLost, expected="1 s"):
                sound.play_signal(np.ones(2 * RATE_HZ), wait=True)
        assert sound.halted
        assert len(sound.faults()) == 1
        assert sound.pid is not None
        os.kill(sound.pid, signal.SIGKILL)
        wait_until(lambda: sound.pid is None or sound.faults())
        assert sound.halted  # a process that is lost, too, is no reason to play on
        sound.play_signal(np.ones(100), wait=True)
        assert not sound.halted


def test_a_dead_parent_leaves_silence_and_no_process(
    server: Any, parent: Parent, tmp_path: Path
) -> None:
    # A server that runs free does not get over a client that dies.
    recorder = Recorder(server, tmp_path / "captured.npy", paced=False)
    sleep(0.2)
    parent.process.kill()
    parent.process.wait()
    wait_until(lambda: "PortAudio:out_0" not in server.ports())
    captured = recorder.recorded()[:, 0]
    assert captured.any()
    assert silent_from(captured) < captured.size
    falls = np.abs(captured[silent_from(captured) - FADE :][:FADE])
    assert falls[-24:].max() < 0.2 * np.abs(captured).max()  # it faded, it was not cut
    wait_until(lambda: has_ended(parent.child))


def has_ended(process: int) -> bool:
    """Also where nobody has asked for its exit code, as of orphans."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except FileNotFoundError:
        return True


# --- Bad input ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "expected", "got"),
    [
        ({"device": "another"}, ["output", "'another'"], "none"),
        ({"channels": 9}, [9, "output"], ["'system'", 2]),
    ],
)
def test_a_device_that_is_not_there_is_refused(
    server: Any, settings: dict[str, Any], expected: object, got: object
) -> None:
    with Live.create() as live, refused(InputError, expected=expected, got=got):
        output(live, **settings).open()


def test_a_rate_that_the_card_does_not_do_is_refused_with_those_it_does(server: Any) -> None:
    with Live.create() as live, refused(InputError, expected="system", got=["44100 Hz", 48000]):
        SoundOutput(
            live, device="system", rate_hz=44100, block=128, fullscale_per_g=SCALE, limits=LIMITS
        ).open()


@pytest.mark.parametrize(
    ("settings", "expected", "got"),
    [
        ({"limits": Limits()}, ["peak limit", "20 g"], "inf g"),
        ({"fullscale_per_g": 0.2}, ["peak limit", "5 g"], "10 g"),
        ({"fullscale_per_g": 0.0}, ["full scale per g", 0], 0.0),
        ({"masking_channel": 0}, ["channels", 0, 1, "masking"], "0 and 0"),
        ({"vibration_channel": 2}, ["channels", 0, 1, "vibration"], 2),
        ({"block": 8}, ["block", 16, 4096], 8),
    ],
)
def test_settings_are_checked_before_anything_starts(
    settings: dict[str, Any], expected: object, got: object
) -> None:
    with Live.create() as live, refused(InputError, expected=expected, got=got):
        output(live, **settings)


@pytest.mark.parametrize(
    ("samples", "expected", "got"),
    [
        ([], "(n,)", "(0,)"),
        ([[1.0]], "(n,)", "(1, 1)"),
        ([np.nan], "finite", "NaN"),
        ([11.0], "10 g", "11 g"),
        (np.full(RATE_HZ, 6.0), ["RMS", "5 g"], "5.653 g"),
        (np.full(3 * RATE_HZ, 1.0), "2 s", "3 s"),
    ],
)
def test_signals_beyond_the_limits_are_refused(samples: Any, expected: object, got: object) -> None:
    limits = Limits(peak=10.0, rms=5.0, duration_s=2.0)
    with Live.create() as live, refused(InputError, expected=expected, got=got):
        output(live, limits=limits).play_signal(samples)


@pytest.mark.parametrize("level", [-0.1, 0.6, np.nan])
def test_masking_out_of_range_is_refused(level: float) -> None:
    with Live.create() as live, refused(InputError, expected=[0, 0.5], got=level):
        output(live, masking_channel=1).masking(level)


def test_masking_without_a_channel_is_refused() -> None:
    with Live.create() as live, refused(InputError, names="masking_channel", got="none"):
        output(live).masking(0.1)
