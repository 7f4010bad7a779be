"""Tablets and mice by Linux' event devices (docs/method/hand.md#devices).

The requests are those of include/uapi/linux/input.h, numbered as asm-generic/ioctl.h does: right
for x86, ARM and RISC-V.
"""

from __future__ import annotations

import errno
import os
import struct
import time
from fcntl import ioctl
from pathlib import Path

from tactileq.modeling.errors import InputError, shown
from tactileq.rig.devices.hand.events import (
    ABS_PRESSURE,
    ABS_X,
    ABS_Y,
    BTN_LEFT,
    BTN_STYLUS,
    BTN_TOOL_PEN,
    BTN_TOOL_RUBBER,
    BTN_TOUCH,
    EV_ABS,
    EV_KEY,
    EVENT,
    REL_X,
    REL_Y,
    AbsoluteAxis,
    Frame,
    FrameReader,
    HandOfFrames,
    MouseHand,
    PenHand,
    State,
)
from tactileq.rig.devices.hand.pressure import PressureCurve
from tactileq.rig.devices.hand.sample import ConnectedDevice, DeviceLost, Sample
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.hand.tracking import REST_S
from tactileq.rig.shared.live.clock import now_s, readable

SYSFS = Path("/sys/class/input")
DEV = Path("/dev/input")
_AT_ONCE = 256 * EVENT.size
_ABSINFO = struct.Struct("@6i")  # value, minimum, maximum, fuzz, flat, resolution
_KEY_BYTES = 96  # KEY_CNT bits


def _request(direction: int, number: int, size: int) -> int:
    return direction << 30 | size << 16 | ord("E") << 8 | number


_READ, _WRITE = 2, 1
EVIOCGKEY = _request(_READ, 0x18, _KEY_BYTES)
EVIOCGRAB = _request(_WRITE, 0x90, 4)
EVIOCSCLOCKID = _request(_WRITE, 0xA0, 4)


def eviocgbit(kind: int, size: int) -> int:
    """The request for which codes of a type a device has."""
    return _request(_READ, 0x20 + kind, size)


def eviocgabs(axis: int) -> int:
    """The request for what an absolute axis is like."""
    return _request(_READ, 0x40 + axis, _ABSINFO.size)


# --- What is connected ----------------------------------------------------------------------------


def input_devices() -> tuple[ConnectedDevice, ...]:
    """All event devices, by their number; also those that may not be read."""
    places = sorted(SYSFS.glob("event*"), key=lambda place: int(place.name[5:] or 0))
    return tuple(_described(place) for place in places)


def _described(place: Path) -> ConnectedDevice:
    path = DEV / place.name
    codes = {kind: _capabilities(place, kind) for kind in ("key", "abs", "rel")}
    kind = "other"
    if {ABS_X, ABS_Y} <= codes["abs"] and BTN_TOOL_PEN in codes["key"]:
        kind = "tablet"
    elif {REL_X, REL_Y} <= codes["rel"] and BTN_LEFT in codes["key"]:
        kind = "mouse"
    name = _text(place / "device" / "name").strip() or "unknown"
    return ConnectedDevice(str(path), name, kind, os.access(path, os.R_OK))


def _capabilities(place: Path, kind: str) -> set[int]:
    """Codes that a device has: set bits of words in hexadecimal digits, the highest first."""
    bits = 0
    for word in _text(place / "device" / "capabilities" / kind).split():
        bits = bits << struct.calcsize("@L") * 8 | int(word, 16)
    return {code for code in range(bits.bit_length()) if bits >> code & 1}


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


# --- An open device -------------------------------------------------------------------------------


class EventDevice:
    """An open tablet or mouse.

    Parameters
    ----------
    handle : int
        File descriptor, which this closes.
    hand : HandOfFrames
        Makes samples of its frames.
    """

    rest_s = REST_S
    firmware = ""

    def __init__(self, handle: int, name: str, *, hand: HandOfFrames) -> None:
        self.name = name
        self._handle = handle
        self._hand = hand
        self._frames = FrameReader()
        self._is_new = True
        os.set_blocking(handle, False)

    @classmethod
    def open(cls, settings: HandSettings) -> EventDevice:
        """The tablet or mouse of these settings.

        Raises
        ------
        InputError
            Without the device, permission, or its resolution.
        """
        path, name = _found(settings)
        handle = _opened(path, settings.kind)
        try:
            hand = _hand(handle, settings, name=name)
            _prepare(handle, grab=settings.grab, name=name)
            return cls(handle, name, hand=hand)
        except BaseException:
            os.close(handle)
            raise

    def wait(self, seconds: float) -> None:
        """Until events come."""
        readable(self._handle, seconds)

    def read(self) -> list[Sample]:
        """The samples of all frames that have come; DeviceLost where the device is gone.

        The first one is that of the device as it was found: one at rest sends none.
        """
        samples = [self._hand.sample(Frame(now_s(), (), dropped=False))] if self._is_new else []
        self._is_new = False
        for frame in self._frames.feed(self._received()):
            if frame.dropped:
                self._hand.renew(_state(self._handle))
            samples.append(self._hand.sample(frame))
        return samples

    def counts(self) -> dict[str, int]:
        """Frames that came, and those in which the kernel had to drop events."""
        return {"frames": self._frames.frames, "dropped": self._frames.dropped}

    def close(self) -> None:
        """Give the device back."""
        os.close(self._handle)

    def _received(self) -> bytes:
        try:
            piece = os.read(self._handle, _AT_ONCE)
        except BlockingIOError:
            return b""
        except OSError:  # ENODEV: unplugged
            piece = b""
        if not piece:
            raise DeviceLost(f"{self.name} was unplugged.")
        return piece


def _found(settings: HandSettings) -> tuple[str, str]:
    """Path and name of the device that is meant."""
    devices = input_devices()
    fit = [device for device in devices if device.kind == settings.kind]
    if settings.device is None:
        if len(fit) != 1:
            raise InputError(
                f"expected one {settings.kind}, or device under [hand], got {_listed(fit)}; plug "
                f"it in or name it (connected: {_listed(devices)})."
            )
        return fit[0].path, fit[0].name
    for device in devices:
        if settings.device == device.name and device.kind == settings.kind:
            return device.path, device.name
    if settings.device.startswith("/"):
        real = os.path.realpath(settings.device)
        names = [device.name for device in devices if os.path.realpath(device.path) == real]
        return settings.device, names[0] if names else settings.device
    raise InputError(
        f"expected a {settings.kind} called {shown(settings.device)}, got none; connected are "
        f"{_listed(devices)}."
    )


def _opened(path: str, kind: str) -> int:
    try:
        return os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except PermissionError:
        raise InputError(
            f"expected permission to read the {kind} at {path}, got none; run `sudo usermod -aG "
            "input $USER` and log in again."
        ) from None
    except OSError as error:
        got = "nothing there" if error.errno == errno.ENOENT else f"{error.strerror}"
        raise InputError(
            f"expected a {kind} at {path}, got {got}; connected are {_listed(input_devices())}."
        ) from None


def _listed(devices: tuple[ConnectedDevice, ...] | list[ConnectedDevice]) -> str:
    return ", ".join(map(str, devices)) or "none"


def _hand(handle: int, settings: HandSettings, *, name: str) -> HandOfFrames:
    if settings.kind == "mouse":
        assert settings.counts_per_mm is not None  # which the settings make sure of
        return MouseHand(settings.counts_per_mm)
    points = settings.pressure_points
    curve = None if points is None else PressureCurve(points)
    axes = _axes(handle, settings, name=name)
    if curve is not None and ABS_PRESSURE not in axes and settings.assumed_force_n is None:
        raise InputError(
            f"expected a tablet that measures pressure, got {name}, which does not; give "
            "assumed_force_n under [hand], or take another tablet."
        )
    return PenHand(axes, curve, state=_state(handle))


def _axes(handle: int, settings: HandSettings, *, name: str) -> dict[int, AbsoluteAxis]:
    """The axes of a tablet: X and Y with steps per mm, and pressure where there is such."""
    axes = {}
    for code in (ABS_X, ABS_Y, ABS_PRESSURE):
        found = _asked(handle, eviocgabs(code), _ABSINFO.size)
        if found is not None:
            _, low, high, _, _, resolution = _ABSINFO.unpack(found)
            axes[code] = AbsoluteAxis(low, high, settings.counts_per_mm or float(resolution))
    if axes.get(ABS_PRESSURE) and axes[ABS_PRESSURE].high <= axes[ABS_PRESSURE].low:
        del axes[ABS_PRESSURE]
    if ABS_X not in axes or ABS_Y not in axes:
        raise InputError(
            f"expected a tablet, got {name}, which states no position; connected are "
            f"{_listed(input_devices())}."
        )
    if not axes[ABS_X].per_mm > 0 or not axes[ABS_Y].per_mm > 0:
        raise InputError(
            f"expected a resolution from {name}, got none; give counts_per_mm under [hand] "
            f"(range of x: {axes[ABS_X].high - axes[ABS_X].low} counts over the active width)."
        )
    return axes


def _prepare(handle: int, *, grab: bool, name: str) -> None:
    """Have events stamped with the clock of all processes, and keep them from others if asked."""
    try:
        ioctl(handle, EVIOCSCLOCKID, struct.pack("@i", time.CLOCK_MONOTONIC))
    except OSError:
        raise InputError(
            f"expected an input device of Linux, got {name}, which is none; connected are "
            f"{_listed(input_devices())}."
        ) from None
    if not grab:
        return
    try:
        ioctl(handle, EVIOCGRAB, 1)
    except OSError:
        raise InputError(
            f"expected {name} for this program alone (grab), got one that another program has "
            "grabbed; end that program."
        ) from None


def _state(handle: int) -> State:
    """What a device is like now: axes, and the keys that it has."""
    state: State = {}
    for code in (ABS_X, ABS_Y, ABS_PRESSURE):
        found = _asked(handle, eviocgabs(code), _ABSINFO.size)
        if found is not None:
            state[EV_ABS, code] = _ABSINFO.unpack(found)[0]
    has = _asked(handle, eviocgbit(EV_KEY, _KEY_BYTES), _KEY_BYTES)
    down = _asked(handle, EVIOCGKEY, _KEY_BYTES)
    for key in (BTN_LEFT, BTN_TOOL_PEN, BTN_TOOL_RUBBER, BTN_TOUCH, BTN_STYLUS):
        if has is not None and down is not None and has[key // 8] >> key % 8 & 1:
            state[EV_KEY, key] = down[key // 8] >> key % 8 & 1
    return state


def _asked(handle: int, request: int, size: int) -> bytes | None:
    """The answer of a device, None where it has none."""
    try:
        return bytes(ioctl(handle, request, bytes(size)))
    except OSError:
        return None
