"""tactileq rig monitor where the sound process, the server or the monitor itself fails."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

import pytest

from tactileq.commands.rig.monitor import _play_on
from tactileq.modeling import InputError
from tactileq.rig.shared.live.memory import Live
from tactileq.stimuli.planted.textures import planted_texture
from tests.rig.desk.rig_files import rig_file
from tests.rig.waiting import wait_until

Jack = Callable[..., AbstractContextManager[Any]]
Monitor = subprocess.Popen[str]


@pytest.fixture
def server(jack_server: Jack) -> Iterator[Any]:
    with jack_server(block=256) as running:
        yield running


@pytest.fixture
def monitor(server: Any, tmp_path: Path) -> Iterator[Monitor]:
    """It shows a model that plays."""
    rig_file(tmp_path)
    planted_texture("canvas").save(tmp_path / "model.json")
    process = subprocess.Popen(
        [sys.executable, "-m", "tactileq", "rig", "monitor", "model.json"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_until(lambda: is_felt(process))
    yield process
    process.kill()
    process.communicate()


def sound_process(monitor: Monitor) -> tuple[int, Path] | None:
    """Its number, and the memory that it shares; None where there is none."""
    children = Path(f"/proc/{monitor.pid}/task/{monitor.pid}/children").read_text().split()
    for child in children:
        with suppress(OSError):  # it may end meanwhile
            words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
            maps = Path(f"/proc/{child}/maps").read_text().split()
            shared = [word for word in maps if "/tactileq-live-" in word]
            if b"tactileq.rig.devices.sound.process" in words and shared:
                return int(child), Path(shared[0])
    return None


def is_felt(monitor: Monitor) -> bool:
    """Whether something plays."""
    found = sound_process(monitor)
    if found is None:
        return False
    with Live.attach(found[1]) as live:
        _, rows = live.blocks_since(max(0, live.blocks_written - 50))
    return bool(rows["peak_g"].any())


def test_a_lost_sound_process_is_replaced_and_a_lost_server_ends_the_monitor(
    server: Any, monitor: Monitor
) -> None:
    (first, live) = sound_process(monitor) or (0, Path())
    os.kill(first, signal.SIGKILL)
    with Live.attach(live) as shared:
        wait_until(lambda: (sound_process(monitor) or (first,))[0] != first)
        before = shared.blocks_written
        wait_until(lambda: bool(shared.blocks_since(before)[1]["peak_g"].any()))
    server.kill()
    shown, told = monitor.communicate(timeout=500)
    assert monitor.returncode == 1
    assert shown.count("fault: expected the sound process to play") == 2
    assert told.startswith("error: expected ")
    assert told.count("\n") == 1


class HaltedSound:
    """A sound whose vibration was halted, and whose process runs."""

    halted = True
    pid = 1


def test_a_monitor_that_stood_still_ends_with_the_sentence() -> None:
    with pytest.raises(InputError, match="poll the rig"):
        _play_on(HaltedSound(), None, ["the tablet is gone.", "expected … poll the rig …"])  # type: ignore[arg-type]
