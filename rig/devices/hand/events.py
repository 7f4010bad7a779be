"""Events of Linux input devices: bytes to frames, frames to samples; no device.

Layout and codes: Linux, include/uapi/linux/input.h and input-event-codes.h; what a reader has to do
after a loss: Documentation/input/event-codes.rst (docs/method/hand.md#devices).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from typing import NamedTuple, Protocol

from tactileq.rig.devices.hand.pressure import PressureCurve
from tactileq.rig.devices.hand.sample import Sample

# struct input_event: seconds and microseconds (two words of the machine), type, code, value.
EVENT = struct.Struct("@LLHHi")
EV_SYN, EV_KEY, EV_REL, EV_ABS = 0x00, 0x01, 0x02, 0x03
SYN_REPORT, SYN_DROPPED = 0, 3
REL_X, REL_Y = 0x00, 0x01
ABS_X, ABS_Y, ABS_PRESSURE = 0x00, 0x01, 0x18
BTN_LEFT, BTN_TOOL_PEN, BTN_TOOL_RUBBER, BTN_TOUCH, BTN_STYLUS = 0x110, 0x140, 0x141, 0x14A, 0x14B

State = dict[tuple[int, int], int]  # value by type and code


class Event(NamedTuple):
    """One event: what of the device, and its new value."""

    type: int
    code: int
    value: int


class Frame(NamedTuple):
    """What happened at one moment.

    Parameters
    ----------
    time_s : float
        By the clock that the device was set to use.
    dropped : bool
        The kernel had to throw events away: what the device is like has to be queried again.
    """

    time_s: float
    events: tuple[Event, ...]
    dropped: bool


class FrameReader:
    """Frames from the bytes that an input device gives.

    Attributes
    ----------
    frames, dropped : int
        How many there were, and how many of them with a loss.
    """

    def __init__(self) -> None:
        self.frames = self.dropped = 0
        self._rest = b""
        self._events: list[Event] = []
        self._losing = False

    def feed(self, piece: bytes) -> list[Frame]:
        """The frames that end in this piece of the stream, however it is cut."""
        stream = self._rest + piece
        whole = len(stream) - len(stream) % EVENT.size
        self._rest = stream[whole:]
        found = []
        for seconds, microseconds, *event in EVENT.iter_unpack(stream[:whole]):
            if self._ends(Event(*event)):
                found.append(self._frame(seconds + microseconds * 1e-6))
        return found

    def _ends(self, event: Event) -> bool:
        """Whether this event ends its frame."""
        if event.type != EV_SYN:
            self._events.append(event)
        elif event.code == SYN_DROPPED:
            self._losing = True
        return event.type == EV_SYN and event.code == SYN_REPORT

    def _frame(self, time_s: float) -> Frame:
        frame = Frame(time_s, () if self._losing else tuple(self._events), self._losing)
        self.frames += 1
        self.dropped += self._losing
        self._events, self._losing = [], False
        return frame


@dataclass(frozen=True)
class AbsoluteAxis:
    """An absolute axis of a device: its range, and how many steps are 1 mm (0: not stated)."""

    low: int
    high: int
    per_mm: float = 0.0

    def share(self, value: int) -> float:
        """A value as a share (0–1) of the range."""
        return (value - self.low) / (self.high - self.low) if self.high > self.low else nan


class HandOfFrames(Protocol):
    """Makes samples of the frames of one kind of device."""

    def sample(self, frame: Frame) -> Sample:
        """The hand after this frame."""

    def renew(self, state: State) -> None:
        """Take over what the device is like, after events were dropped."""


class PenHand:
    """A pen on a tablet.

    Parameters
    ----------
    axes : mapping of int to AbsoluteAxis
        ABS_X and ABS_Y with steps per mm; ABS_PRESSURE where the tablet has it.
    curve : PressureCurve or None
        Force over pressure; None where it is not known.
    state : dict
        What the tablet is like now. A tool that it names among its keys is out of reach until it
        says otherwise.
    """

    def __init__(
        self, axes: Mapping[int, AbsoluteAxis], curve: PressureCurve | None, *, state: State
    ) -> None:
        self._axes = axes
        self._curve = curve if ABS_PRESSURE in axes else None
        self._state = dict(state)

    def sample(self, frame: Frame) -> Sample:
        """The pen after this frame; without a position where it is out of reach."""
        self._state.update({(e.type, e.code): e.value for e in frame.events})
        touches = self._in_reach and self._is_down(BTN_TOUCH)
        force_n = None if self._curve is None else 0.0
        if self._curve is not None and touches:
            pressure = self._state.get((EV_ABS, ABS_PRESSURE), 0)
            force_n = self._curve.force_n(self._axes[ABS_PRESSURE].share(pressure))
        return Sample(
            frame.time_s,
            self._position(ABS_X),
            self._position(ABS_Y),
            force_n=force_n,
            contact=touches,
            button=self._is_down(BTN_STYLUS),
        )

    def renew(self, state: State) -> None:
        """Take over what the tablet is like."""
        self._state.update(state)

    @property
    def _in_reach(self) -> bool:
        tools = [(EV_KEY, tool) for tool in (BTN_TOOL_PEN, BTN_TOOL_RUBBER)]
        known = [tool for tool in tools if tool in self._state]
        return any(self._state[tool] for tool in known) or not known

    def _is_down(self, key: int) -> bool:
        return bool(self._state.get((EV_KEY, key), 0))

    def _position(self, code: int) -> float:
        value = self._state.get((EV_ABS, code))
        if value is None or not self._in_reach:
            return nan
        return (value - self._axes[code].low) / self._axes[code].per_mm


class MouseHand:
    """A mouse: its counts summed since it was opened; it always touches."""

    def __init__(self, counts_per_mm: float) -> None:
        self._per_mm = counts_per_mm
        self._counts = {REL_X: 0, REL_Y: 0}
        self._button = False

    def sample(self, frame: Frame) -> Sample:
        """The mouse after this frame."""
        for event in frame.events:
            if event.type == EV_REL and event.code in self._counts:
                self._counts[event.code] += event.value
            elif (event.type, event.code) == (EV_KEY, BTN_LEFT):
                self._button = bool(event.value)
        x_mm, y_mm = (self._counts[axis] / self._per_mm for axis in (REL_X, REL_Y))
        return Sample(frame.time_s, x_mm, y_mm, button=self._button)

    def renew(self, state: State) -> None:
        """Take over the button; counts that were dropped are lost."""
        self._button = bool(state.get((EV_KEY, BTN_LEFT), 0))
