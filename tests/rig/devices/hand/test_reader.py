"""The hand's process and who watches it: readings, faults, and every way to end."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.files.columns import names
from tactileq.modeling.files.tables import write_table
from tactileq.rig.devices.hand.following import Follower
from tactileq.rig.devices.hand.reader import HandReader
from tactileq.rig.devices.hand.sample import Sample
from tactileq.rig.devices.hand.scripted import SCRIPT_COLUMNS
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.hand.window import PointerDevice
from tactileq.rig.devices.sound.messages import Silence
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.memory import BUTTON, CONTACT, FORCE_ASSUMED, SIMULATED, Live
from tests.refusals import refused
from tests.rig.waiting import follow, is_gone, wait_until

pytestmark = pytest.mark.usefixtures("given_clock")
HOLD = HandSettings(kind="scripted", script="hold", speed_mm_s=120.0, force_n=2.0)


@pytest.fixture
def live() -> Iterator[Live]:
    with Live.create() as memory:
        yield memory


def moves(live: Live) -> bool:
    latest = live.latest()
    return latest is not None and abs(latest["speed_mm_s"]) > 100


def test_a_held_hand_is_read_with_its_speed_and_force(live: Live) -> None:
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: live.readings_written > 300)
        _, rows = live.readings_since(0)
        assert reader.faults() == ()
        assert reader.device_name == "scripted hand"
    settled = rows[20:]  # 40 ms
    np.testing.assert_allclose(settled["speed_mm_s"], 120, rtol=1e-6)
    assert set(settled["force_n"]) == {2.0}
    assert set(settled["flags"]) == {CONTACT | SIMULATED}
    assert (np.diff(rows["time_s"]) >= 0).all()
    assert np.median(np.diff(rows["time_s"])) <= 0.005  # 200 a second or more, by their own clock
    assert abs(rows["time_s"][-1] - now_s()) < 20


def test_files_named_as_libraries_in_the_working_folder_do_no_harm(
    live: Live, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("tactileq", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise ValueError('not this one')\n")
    monkeypatch.chdir(tmp_path)
    with HandReader(live, HOLD):
        wait_until(lambda: moves(live))


def test_what_the_process_says_when_it_cannot_start_is_passed_on(
    live: Live, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "numpy.py").write_text("raise ValueError('what went wrong')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with refused(InputError, got=[1, "ValueError: what went wrong"]):
        HandReader(live, HOLD).open()


def test_strokes_to_and_fro_change_their_sign(live: Live) -> None:
    strokes = HandSettings(kind="scripted", speed_mm_s=200.0, force_n=1.0, strokes_per_s=4.0)
    with HandReader(live, strokes):
        wait_until(lambda: live.readings_written > 500)
        _, rows = live.readings_since(0)
    assert rows["speed_mm_s"].max() == pytest.approx(200, rel=0.05)
    assert rows["speed_mm_s"].min() == pytest.approx(-200, rel=0.05)


def test_closing_leaves_behind_that_nobody_touches(live: Live) -> None:
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: moves(live))
        pid = reader.pid
    assert is_gone(live)
    latest = live.latest()
    assert latest is not None
    assert (latest["speed_mm_s"], latest["force_n"]) == (0, 0)
    assert pid is not None
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_unplugged_it_is_gone_with_one_fault_and_comes_back(live: Live) -> None:
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: moves(live))
        reader.unplug()
        wait_until(lambda: is_gone(live))
        written = live.readings_written
        wait_until(lambda: live.readings_written > written + 100)  # the heart goes on beating
        assert reader.faults() == ("the device of the hand was unplugged on request.",)
        reader.unplug(False)
        wait_until(lambda: moves(live))
        assert reader.faults() == ()


def test_a_request_that_it_does_not_know_is_a_fault_and_it_reads_on(live: Live) -> None:
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: moves(live))
        first = reader.pid
        assert reader._child is not None
        reader._child.send(Silence())
        told = list[str]()
        wait_until(lambda: bool(told.extend(reader.faults()) or told))
        assert ["Silence" in fault for fault in told] == [True]
        written = live.readings_written
        wait_until(lambda: live.readings_written > written + 100)
        assert reader.pid == first


def test_killed_it_is_gone_at_once_and_started_again(live: Live) -> None:
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: moves(live))
        first = reader.pid
        assert first is not None
        os.kill(first, signal.SIGKILL)
        wait_until(lambda: is_gone(live))
        wait_until(lambda: moves(live))
        assert reader.pid != first
        assert reader.faults() == (
            "the process that reads the hand ended by SIGKILL and is started again.",
        )


def test_stopped_it_is_killed_and_replaced(live: Live) -> None:
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: moves(live))
        first = reader.pid
        assert first is not None
        os.kill(first, signal.SIGSTOP)
        wait_until(lambda: is_gone(live))
        wait_until(lambda: moves(live))
        assert reader.pid != first
        told = reader.faults()
        assert told[0] == "the process that reads the hand has not written for 1 s and is killed."
        assert len(told) == 2


def test_who_watches_does_not_kill_for_time_in_which_it_was_held_up_itself(
    live: Live, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader = HandReader(live, HOLD)
    moments_s = iter([0.0, 0.1, 0.2, 30.0, 30.4, 30.8, 31.0, 31.1, 31.2])
    now, killed_s = [0.0], list[float]()

    class Closing:
        def wait(self, seconds: float) -> bool:
            now[0] = next(moments_s, -1.0)
            return now[0] < 0

    class Process:
        def kill(self) -> None:
            killed_s.append(now[0])

    live.write_reading(0.0, 0.0, y_mm=0.0, speed_mm_s=0.0, force_n=0.0, flags=0)
    reader._closing = Closing()  # type: ignore[assignment]
    reader._child = Process()  # type: ignore[assignment]
    reader._alive_s = 0.0
    monkeypatch.setattr("tactileq.rig.devices.hand.reader.now_s", lambda: now[0])
    monkeypatch.setattr(
        "tactileq.rig.devices.hand.reader.wait_for", lambda wait, seconds: wait(seconds)
    )
    reader._watch()
    assert killed_s == [31.1]  # no reading for over a second in which it looked


def test_the_hand_is_read_on_while_this_process_holds_pythons_lock(live: Live) -> None:
    sleep_us = ctypes.PyDLL(None).usleep  # a C function that keeps the lock meanwhile
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: moves(live))
        first, written = reader.pid, live.readings_written
        sleep_us(1_500_000)
        meanwhile = live.readings_written - written
        sleep(0.3)  # who watches wakes up, and finds a process that lives
        assert meanwhile > 100
        assert (reader.pid, reader.faults()) == (first, ())


def test_ctrl_c_at_the_terminal_does_not_end_it(live: Live) -> None:
    with HandReader(live, HOLD) as reader:
        wait_until(lambda: moves(live))
        first = reader.pid
        assert first is not None
        os.kill(first, signal.SIGINT)
        written = live.readings_written
        wait_until(lambda: live.readings_written > written + 200)
        assert reader.faults() == ()
        assert reader.pid == first


def test_started_again_without_its_device_it_waits_for_it_and_is_watched(
    live: Live, tmp_path: Path
) -> None:
    table = tmp_path / "hand.tsv"
    rows = [(0.0, 0.0, 0.0, 1.0), (1000.0, 150_000.0, 0.0, 1.0)]
    write_table(
        table, SCRIPT_COLUMNS, [dict(zip(names(SCRIPT_COLUMNS), row, strict=True)) for row in rows]
    )
    with HandReader(live, HandSettings(kind="scripted", script=str(table))) as reader:
        wait_until(lambda: moves(live))
        table.rename(tmp_path / "away.tsv")
        os.kill(reader.pid or 0, signal.SIGKILL)
        faults: list[str] = []
        wait_until(lambda: bool(faults.extend(reader.faults()) or len(faults) == 2))
        assert faults[1].startswith(f"expected a table at {table}, got nothing there")
        second = reader.pid
        os.kill(second or 0, signal.SIGSTOP)
        wait_until(lambda: reader.pid not in (second, None))
        assert is_gone(live)
        (tmp_path / "away.tsv").rename(table)
        wait_until(lambda: moves(live))


def test_the_process_ends_when_its_parent_is_killed(live: Live) -> None:
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import sys, time\n"
            "from tactileq.rig.devices.hand.reader import HandReader\n"
            "from tactileq.rig.devices.hand.settings import HandSettings\n"
            "from tactileq.rig.shared.live.memory import Live\n"
            "live = Live.attach(sys.argv[1])\n"
            "reader = HandReader(live, HandSettings(kind='scripted', script='hold'))\n"
            "reader.open()\n"
            "print(reader.pid, flush=True)\n"
            "time.sleep(600)\n",
            str(live.path),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    wait_until(lambda: moves(live))
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_until(lambda: is_gone(live))
    wait_until(lambda: not runs(pid))


def runs(pid: int) -> bool:
    """Whether a process does anything; one that nobody has waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_what_cannot_be_opened_is_refused_in_the_process_own_sentence(live: Live) -> None:
    missing = HandSettings(kind="scripted", script="/no/such/table.tsv")
    with refused(InputError, expected="/no/such/table.tsv", got="nothing"):
        HandReader(live, missing).open()
    assert live.latest() is None


def test_it_can_be_opened_again(live: Live) -> None:
    reader = HandReader(live, HOLD)
    for _ in range(2):
        reader.open()
        wait_until(lambda: moves(live))
        reader.close()
        assert is_gone(live)
    reader.close()


def test_a_window_pushes_pixels_and_force_is_assumed(live: Live) -> None:
    window = HandSettings(kind="window", counts_per_mm=4.0, assumed_force_n=1.0)
    with HandReader(live, window) as reader:
        start_s = now_s()
        follow(
            0.3,
            lambda: reader.push(1000 * (now_s() - start_s), 0.0, button=True),
            every_s=0.005,
        )
        _, rows = live.readings_since(0)
        touching = rows[rows["flags"] == CONTACT | BUTTON | FORCE_ASSUMED]
        assert np.median(touching["speed_mm_s"][20:]) == pytest.approx(250, rel=0.05)
        assert set(touching["force_n"]) == {1.0}
        reader.push(5000.0, 0.0, down=False)
        wait_until(lambda: live.latest()["flags"] == FORCE_ASSUMED)  # type: ignore[index]
        assert live.latest()["force_n"] == 0  # type: ignore[index]
        wait_until(lambda: live.latest()["speed_mm_s"] == 0)  # type: ignore[index]
    assert is_gone(live)


def test_two_missed_frames_of_a_window_change_no_speed() -> None:
    settings = HandSettings(kind="window", counts_per_mm=4.0, assumed_force_n=1.0)
    follower = Follower(settings, rest_s=PointerDevice.rest_s)
    for frame in (*range(20), *range(22, 40)):
        follower.update(Sample(frame / 60, 100 * frame / 60, 0.0))
        if frame > 2:
            assert follower.at(frame / 60 + 0.049).speed_mm_s == pytest.approx(100)


def test_only_a_window_is_pushed_to(live: Live) -> None:
    with refused(InputError, expected='"window"', got='"scripted"'):
        HandReader(live, HOLD).push(1.0, 2.0)
