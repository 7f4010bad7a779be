"""The link's thread: deadlines, bounded queues, a cable that is pulled, and never arming again."""

from __future__ import annotations

import os
import pty
import threading
import tty
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tactileq.rig.machines.device.models import device_model
from tactileq.rig.machines.device.registers import DeviceCause, DeviceCommand, DeviceState
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.wire.conversation import Block
from tactileq.rig.shared.wire.link import Link, _Command
from tactileq.rig.shared.wire.transports import Transport, opened_transport
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused
from tests.rig.waiting import follow

pytestmark = pytest.mark.usefixtures("given_clock")
BAUD = 1_000_000
PATIENCE_S = 10.0


class Cable:
    """Between host and device: a pseudo-terminal of its own, which can be pulled and plugged in."""

    def __init__(self, device: str, folder: Path) -> None:
        self.path = folder / "port"
        self._device = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._ours = self._theirs = -1
        self.stalled = False
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self.plug()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def plug(self) -> None:
        with self._lock:
            self._ours, self._theirs = pty.openpty()
            tty.setraw(self._theirs)
            os.set_blocking(self._ours, False)
            self.path.unlink(missing_ok=True)
            self.path.symlink_to(os.ttyname(self._theirs))

    def pull(self) -> None:
        with self._lock:
            self.path.unlink()
            os.close(self._theirs)
            os.close(self._ours)
            self._ours = -1

    def close(self) -> None:
        self._closing.set()
        self._thread.join()
        if self._ours >= 0:
            self.pull()
        os.close(self._device)

    def _run(self) -> None:
        with taking_part():
            while not self._closing.is_set():
                with self._lock:
                    if self._ours >= 0 and not self.stalled:
                        self._pass(self._device, self._ours)
                        self._pass(self._ours, self._device)
                sleep(0.0005)

    @staticmethod
    def _pass(source: int, to: int) -> None:
        with suppress(OSError):
            os.write(to, os.read(source, 4096))


@pytest.fixture
def cable(tmp_path: Path) -> Iterator[Cable]:
    with Emulator("process", CABLE_DEVICE) as device:
        found = Cable(device.address, tmp_path)
        try:
            yield found
        finally:
            found.close()


@contextmanager
def linked(cable: Cable) -> Iterator[Link]:
    def opening() -> Transport:
        return opened_transport(str(cable.path), BAUD)

    with Link(opening, DEVICE) as link:
        until(lambda: link.read("State") != DeviceState.BOOT, what="it does not begin")
        yield link


def until(met: Callable[[], bool], *, what: str) -> None:
    end_s = now_s() + PATIENCE_S
    with taking_part():
        while not met():
            assert now_s() < end_s, what
            sleep(0.01)


def running(link: Link) -> None:
    with taking_part():
        for command in (DeviceCommand.HOME, DeviceCommand.ARM, DeviceCommand.SHOW):
            link.beat()
            link.write("Command", command)
        assert link.read("State") == DeviceState.RUNNING


def during_arming(link: Link) -> None:
    for command in (DeviceCommand.HOME, DeviceCommand.ARM):
        link.write("Command", command)


def during_an_upload(link: Link) -> None:
    assert link.hello is not None
    model = device_model(planted_texture("canvas"), link.hello)
    while True:
        link.upload(model.data, model.hash)


def during_reads(link: Link) -> None:
    while True:
        link.read("State")


def during_writes(link: Link) -> None:
    while True:
        link.write("Source", 0)


@pytest.mark.parametrize("what", [during_reads, during_writes, during_an_upload, during_arming])
def test_a_cable_that_is_pulled_is_a_fault_and_arms_nothing_when_it_is_back(
    cable: Cable, what: Callable[[Link], None]
) -> None:
    with linked(cable) as link:
        running(link) if what is not during_arming else None
        if what is during_arming:
            what(link)
            cable.pull()
        else:
            threading.Timer(0.15, cable.pull).start()
            with refused(InputError, expected="device"):
                while True:
                    link.beat()
                    what(link)
        until(lambda: not link.connected, what="the link does not notice")
        with refused(InputError, expected="device"):
            link.read("State")
        sleep(0.2)
        cable.plug()
        until(lambda: link.connected, what="the link does not connect again")
        assert link.read("State") == DeviceState.FAULT
        assert link.read("Cause") in (DeviceCause.LINK, DeviceCause.HOST)
        assert link.read("Current") == (0.0, 0.0)
        assert link.counts()["lost"] == 1
        assert len(link.faults()) == 1


def test_a_command_has_a_deadline_and_the_queue_an_end(cable: Cable) -> None:
    with linked(cable) as link:
        link.read("State")
        cable.stalled = True
        with taking_part():
            begun_s = now_s()
            with refused(InputError, expected="device"):
                link.read("State", within_s=0.2)
            assert now_s() - begun_s < 0.45
        refusals: list[str] = []

        def ask() -> None:
            try:
                link.read("State", within_s=0.1)
            except InputError as error:
                refusals.append(str(error))

        threads = [threading.Thread(target=ask) for _ in range(40)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(refusals) == 40
        cable.stalled = False


def test_a_command_that_nobody_waits_for_any_more_does_not_end_the_link() -> None:
    link = Link(lambda: opened_transport("nowhere", BAUD), DEVICE)
    given_up, awaited = (_Command(lambda talk: None, Future()) for _ in range(2))
    assert given_up.answer.cancel()
    for command in (given_up, awaited):
        link._commands.put(command)
    link._disconnect()  # as the link's thread does where the device is lost
    with refused(InputError, expected="device", got="none"):
        awaited.answer.result(0)


def test_a_hanging_control_loop_is_noticed_while_the_links_thread_lives(cable: Cable) -> None:
    with linked(cable) as link:
        running(link)
        follow(0.5, link.beat, every_s=0.05)
        assert link.read("State") == DeviceState.RUNNING
        until(lambda: link.read("State") == DeviceState.FAULT, what="it is not noticed")
        assert link.read("Cause") == DeviceCause.HEARTBEAT
        late = int(link.read("FaultTick")) - int(link.read("HeardTick"))  # type: ignore[arg-type]
        assert late < 500  # the link itself was never silent
        assert link.counts()["lost"] == 0


def test_records_come_without_a_gap(cable: Cable) -> None:
    with linked(cable) as link:
        running(link)
        link.write("EventRate", 1000)
        blocks: list[Block] = []

        def look() -> None:
            link.beat()
            blocks.extend(link.blocks())

        follow(0.6, look)
        link.write("EventRate", 0)
        ends = [block.number + block.values.size for block in blocks]
        assert [block.number for block in blocks[1:]] == ends[:-1]
        assert ends[-1] > 400
        assert link.counts()["missing"] == link.counts()["dropped"] == 0
        assert link.read("RecordsLost") == 0
