"""Tablets and mice: found, refused, read to readings, unplugged.

There are no devices here. Lists come from a folder laid out as /sys/class/input, events from a
named pipe at the place of the device, and a function of the test answers for the kernel.
"""

from __future__ import annotations

import os
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.hand import evdev
from tactileq.rig.devices.hand.devices import connected_devices
from tactileq.rig.devices.hand.evdev import EventDevice, input_devices
from tactileq.rig.devices.hand.events import (
    ABS_PRESSURE,
    ABS_X,
    ABS_Y,
    BTN_LEFT,
    BTN_STYLUS,
    BTN_TOOL_PEN,
    BTN_TOUCH,
    EV_ABS,
    EV_KEY,
    EV_REL,
    EV_SYN,
    EVENT,
    REL_X,
    REL_Y,
    SYN_DROPPED,
    SYN_REPORT,
)
from tactileq.rig.devices.hand.following import Follower
from tactileq.rig.devices.hand.loop import HandLoop
from tactileq.rig.devices.hand.messages import Counts, Firmware, HandFault
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.memory import BUTTON, CONTACT, FORCE_ASSUMED, GONE, Live

TABLET = {"key": [BTN_TOOL_PEN, BTN_TOUCH, BTN_STYLUS], "abs": [ABS_X, ABS_Y, ABS_PRESSURE]}
MOUSE = {"key": [BTN_LEFT], "rel": [REL_X, REL_Y]}
POINTS = ((0.0, 0.0), (1.0, 4.0))
PEN = HandSettings(kind="tablet", pressure_points=POINTS)


class Kernel:
    """Answers what a device is asked, and keeps what it was told."""

    def __init__(self) -> None:
        self.axes = {ABS_X: (500, 0, 20000, 100), ABS_Y: (0, 0, 10000, 100)}
        self.axes[ABS_PRESSURE] = (0, 0, 1000, 0)
        self.has = TABLET["key"]
        self.down: list[int] = []
        self.told: list[tuple[int, object]] = []

    def ioctl(self, handle: int, request: int, argument: object) -> object:
        for code, (value, low, high, resolution) in self.axes.items():
            if request == evdev.eviocgabs(code):
                return struct.pack("@6i", value, low, high, 0, 0, resolution)
        if request == evdev.eviocgbit(EV_KEY, 96):
            return bits(self.has)
        if request == evdev.EVIOCGKEY:
            return bits(self.down)
        if request not in (evdev.EVIOCSCLOCKID, evdev.EVIOCGRAB):
            raise OSError(22, "Invalid argument")
        self.told.append((request, argument))
        return 0


def bits(codes: list[int]) -> bytes:
    return sum(1 << code for code in codes).to_bytes(96, "little")


class Desk:
    """Devices that are connected."""

    def __init__(self, folder: Path) -> None:
        self.sysfs, self.dev = folder / "class", folder / "dev"
        self.sysfs.mkdir()
        self.dev.mkdir()
        self.kernel = Kernel()
        self._handles: dict[str, int] = {}

    def connect(self, number: int, name: str, codes: dict[str, list[int]]) -> None:
        place = self.sysfs / f"event{number}" / "device" / "capabilities"
        place.mkdir(parents=True)
        (place.parent / "name").write_text(name + "\n", encoding="utf-8")
        for kind in ("key", "abs", "rel"):
            value = sum(1 << code for code in codes.get(kind, []))
            words = []
            while value or not words:
                words.append(f"{value & 2**64 - 1:x}")
                value >>= 64
            (place / kind).write_text(" ".join(reversed(words)) + "\n", encoding="utf-8")
        os.mkfifo(self.dev / f"event{number}")
        self._handles[name] = os.open(self.dev / f"event{number}", os.O_RDWR | os.O_NONBLOCK)

    def send(self, name: str, *events: tuple[int, int, int], time_s: float | None = None) -> None:
        """A frame of events, stamped with the clock of all processes."""
        moment = now_s() if time_s is None else time_s
        stamp = (int(moment), int(moment % 1 * 1e6))
        frame = b"".join(EVENT.pack(*stamp, *event) for event in (*events, (EV_SYN, SYN_REPORT, 0)))
        os.write(self._handles[name], frame)

    def unplug(self, name: str) -> None:
        os.close(self._handles.pop(name))


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    desk = Desk(tmp_path)
    monkeypatch.setattr(evdev, "SYSFS", desk.sysfs)
    monkeypatch.setattr(evdev, "DEV", desk.dev)
    monkeypatch.setattr(evdev, "ioctl", desk.kernel.ioctl)
    yield desk
    for name in list(desk._handles):
        desk.unplug(name)


@pytest.fixture
def live() -> Iterator[Live]:
    with Live.create() as memory:
        yield memory


def run_until(loop: HandLoop, holds: Callable[[], bool], *, seconds: float = 20) -> None:
    end_s = now_s() + seconds
    while not holds():
        assert now_s() < end_s, "expected it to happen"
        loop.step()


def test_what_is_connected_is_told_by_name_and_kind(desk: Desk) -> None:
    desk.connect(12, "Some Keyboard", {"key": [30, 31]})
    desk.connect(3, "Small Tablet Pen", TABLET)
    desk.connect(4, "A Mouse", MOUSE)
    told = [(device.name, device.kind, device.readable) for device in input_devices()]
    assert told == [
        ("Small Tablet Pen", "tablet", True),
        ("A Mouse", "mouse", True),
        ("Some Keyboard", "other", True),
    ]
    assert str(input_devices()[1]) == f"A Mouse ({desk.dev / 'event4'}, mouse)"


def test_serial_ports_are_told_beside_input_devices(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk.connect(4, "A Mouse", MOUSE)
    ports = [
        SimpleNamespace(device=f"/dev/ttyACM{n}", description=d) for n, d in ((1, None), (0, "X"))
    ]
    monkeypatch.setattr("tactileq.rig.shared.wire.ports.list_ports.comports", lambda: ports)
    assert list(map(str, connected_devices())) == [
        f"A Mouse ({desk.dev / 'event4'}, mouse)",
        "X (/dev/ttyACM0, serial)",
        "unknown (/dev/ttyACM1, serial)",
    ]


def test_nothing_connected_is_an_empty_list(desk: Desk) -> None:
    assert input_devices() == ()


def test_a_pens_strokes_become_speed_and_newtons(desk: Desk) -> None:
    pen = "Small Tablet Pen"
    desk.connect(3, pen, TABLET)
    device = EventDevice.open(PEN)
    assert device.name == pen
    assert desk.kernel.told == [(evdev.EVIOCSCLOCKID, struct.pack("@i", time.CLOCK_MONOTONIC))]
    follower = Follower(PEN, rest_s=device.rest_s)
    (found,) = map(follower.update, device.read())
    assert found.flags == 0
    assert np.isnan(found.x_mm)
    start_s = now_s()
    desk.send(pen, (EV_KEY, BTN_TOOL_PEN, 1), time_s=start_s)
    for index in range(1, 100):  # 200 a second, 100 mm/s; it touches from the 20th on
        touch = [(EV_KEY, BTN_TOUCH, 1), (EV_ABS, ABS_PRESSURE, 500)] if index == 20 else []
        moment = start_s + 0.005 * index
        desk.send(pen, *touch, (EV_ABS, ABS_X, 500 + 50 * index), time_s=moment)
    readings = [follower.update(sample) for sample in (*device.read(), *device.read())]
    assert len(readings) == 100
    for index, reading in enumerate(readings):
        assert reading.time_s == pytest.approx(start_s + 0.005 * index, abs=1e-5)
        assert reading.x_mm == pytest.approx(5 + 0.5 * index)
        assert (reading.flags, reading.force_n) == ((CONTACT, 2.0) if index >= 20 else (0, 0.0))
        if index > 4:
            assert reading.speed_mm_s == pytest.approx(100, rel=1e-3)  # no spike at touch-down
    device.close()


def test_a_mouse_has_an_assumed_force_on_every_reading(desk: Desk, live: Live) -> None:
    desk.connect(4, "A Mouse", MOUSE)
    settings = HandSettings(kind="mouse", counts_per_mm=40, assumed_force_n=1.5, grab=True)
    loop = HandLoop(live, settings, send=lambda told: None)
    loop.open()
    assert (evdev.EVIOCGRAB, 1) in desk.kernel.told
    run_until(loop, lambda: live.readings_written > 20)
    desk.send("A Mouse", (EV_REL, REL_X, 4), (EV_KEY, BTN_LEFT, 1))
    run_until(loop, lambda: live.readings_written > 40)
    _, rows = live.readings_since(0)
    assert set(rows["flags"]) == {CONTACT | FORCE_ASSUMED, CONTACT | BUTTON | FORCE_ASSUMED}
    assert set(rows["force_n"]) == {1.5}
    assert (rows["x_mm"][0], rows["x_mm"][-1]) == (0.0, 0.1)
    loop.close()


def test_unplugged_it_is_gone_at_once_and_taken_up_again(
    desk: Desk, live: Live, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactileq.rig.devices.hand.loop.AGAIN_S", 0.05)
    desk.connect(3, "Small Tablet Pen", TABLET)
    told: list[HandFault | Counts | Firmware] = []
    named = HandSettings(kind="tablet", device="Small Tablet Pen", pressure_points=POINTS)
    loop = HandLoop(live, named, send=told.append)
    loop.open()
    desk.send("Small Tablet Pen", (EV_KEY, BTN_TOOL_PEN, 1), (EV_ABS, ABS_X, 600))
    run_until(loop, lambda: live.readings_written > 5)
    desk.unplug("Small Tablet Pen")
    loop.step()
    latest = live.latest()
    assert latest is not None
    assert latest["flags"] == GONE
    (desk.dev / "event3").rename(desk.dev / "gone")
    assert [what for what in told if isinstance(what, HandFault)] == [
        HandFault("Small Tablet Pen was unplugged.")
    ]
    # Plugged in again it has another number, and the same name.
    (desk.sysfs / "event3").rename(desk.sysfs / "gone")
    desk.connect(9, "Small Tablet Pen", TABLET)
    run_until(loop, lambda: not live.latest()["flags"] & GONE)  # type: ignore[index]
    desk.send("Small Tablet Pen", (EV_KEY, BTN_TOOL_PEN, 1), (EV_ABS, ABS_X, 700))
    run_until(loop, lambda: live.latest()["x_mm"] == 7)  # type: ignore[index]
    loop.close()


def test_after_dropped_events_the_tablet_is_asked(desk: Desk, live: Live) -> None:
    desk.connect(3, "Small Tablet Pen", TABLET)
    device = EventDevice.open(PEN)
    assert len(device.read()) == 1  # as it was found
    desk.kernel.axes[ABS_X] = (1200, 0, 20000, 100)
    desk.kernel.down = [BTN_TOOL_PEN, BTN_TOUCH]
    desk.kernel.axes[ABS_PRESSURE] = (250, 0, 1000, 0)
    desk.send("Small Tablet Pen", (EV_SYN, SYN_DROPPED, 0), (EV_ABS, ABS_X, 3))
    (sample,) = device.read()
    assert (sample.x_mm, sample.force_n, sample.contact) == (12.0, 1.0, True)
    assert device.counts() == {"frames": 1, "dropped": 1}
    assert device.read() == []
    device.close()


def test_steps_per_mm_of_the_rig_file_win_over_the_tablets(desk: Desk) -> None:
    desk.connect(3, "Small Tablet Pen", TABLET)
    desk.kernel.down = [BTN_TOOL_PEN]
    settings = HandSettings(kind="tablet", pressure_points=POINTS, counts_per_mm=50)
    device = EventDevice.open(settings)
    desk.send("Small Tablet Pen", (EV_ABS, ABS_X, 100))
    assert [sample.x_mm for sample in device.read()] == [10.0, 2.0]
    device.close()


def refused(settings: HandSettings) -> str:
    with pytest.raises(InputError) as error:
        EventDevice.open(settings)
    return str(error.value)


def test_no_device_that_fits_is_refused_with_a_list(desk: Desk) -> None:
    assert "expected one tablet, or device under [hand], got none" in refused(PEN)
    desk.connect(4, "A Mouse", MOUSE)
    said = refused(PEN)
    assert f"connected: A Mouse ({desk.dev / 'event4'}, mouse)" in said
    desk.connect(5, "First Pen", TABLET)
    desk.connect(6, "Second Pen", TABLET)
    assert "got First Pen" in refused(PEN)


@pytest.mark.parametrize(
    ("device", "said"),
    [
        ("No Such Pen", "expected a tablet called 'No Such Pen', got none; connected are First"),
        ("/dev/input/event77", "got nothing there; connected are First Pen"),
        ("A Mouse", "expected a tablet called 'A Mouse', got none"),
    ],
)
def test_a_device_that_is_not_there_is_refused_with_a_list(
    desk: Desk, device: str, said: str
) -> None:
    desk.connect(3, "First Pen", TABLET)
    desk.connect(4, "A Mouse", MOUSE)
    assert said in refused(HandSettings(kind="tablet", device=device, pressure_points=POINTS))


def test_without_permission_it_says_which_line_to_run(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk.connect(3, "First Pen", TABLET)

    def forbid(path: str, flags: int) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(evdev.os, "open", forbid)
    said = refused(PEN)
    monkeypatch.undo()
    assert "got none; run `sudo usermod -aG input $USER` and log in again." in said


def test_a_tablet_without_resolution_is_refused_with_its_range(desk: Desk) -> None:
    desk.connect(3, "First Pen", TABLET)
    desk.kernel.axes[ABS_X] = (0, 0, 20000, 0)
    assert "expected a resolution from First Pen, got none; give counts_per_mm" in refused(PEN)
    assert "(range of x: 20000 counts" in refused(PEN)


def test_a_tablet_without_pressure_is_refused_where_force_is_wanted(desk: Desk) -> None:
    desk.connect(3, "First Pen", TABLET)
    del desk.kernel.axes[ABS_PRESSURE]
    assert "expected a tablet that measures pressure, got First Pen" in refused(PEN)


def test_what_is_no_tablet_or_no_input_device_is_refused(desk: Desk, tmp_path: Path) -> None:
    other = tmp_path / "pipe"
    os.mkfifo(other)
    settings = HandSettings(kind="tablet", device=str(other), pressure_points=POINTS)
    desk.kernel.axes.clear()
    assert f"expected a tablet, got {other}, which states no position" in refused(settings)


def test_a_file_that_is_no_input_device_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"")
    mouse = HandSettings(kind="mouse", device=str(file), counts_per_mm=40, assumed_force_n=1)
    assert "expected an input device of Linux" in refused(mouse)


def test_a_device_that_another_program_has_grabbed_is_refused(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk.connect(4, "A Mouse", MOUSE)

    def busy(handle: int, request: int, argument: object) -> object:
        if request == evdev.EVIOCGRAB:
            raise OSError(16, "Device or resource busy")
        return desk.kernel.ioctl(handle, request, argument)

    monkeypatch.setattr(evdev, "ioctl", busy)
    mouse = HandSettings(kind="mouse", counts_per_mm=40, assumed_force_n=1, grab=True)
    assert "expected A Mouse for this program alone (grab)" in refused(mouse)
