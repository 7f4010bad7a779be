"""The interface of devices that measure the hand."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import NamedTuple, Protocol

LOST_S = 0.1  # a sensor that sends always is lost after this time, and what is older is of no use


class Sample(NamedTuple):
    """The hand at one moment, as a device measures it.

    Parameters
    ----------
    time_s : float
        On the clock of all processes (monotonic).
    x_mm, y_mm : float
        Position; NaN where it is not measured, or where the pen is out of reach.
    speed_mm_s : float or None
        Signed speed where the device itself measures it; None: from the positions.
    force_n : float or None
        Normal force; None where it is not measured.
    contact : bool
        Whether the device says that the hand touches.
    button : bool
        Whether the button is down.
    """

    time_s: float
    x_mm: float = nan
    y_mm: float = nan
    speed_mm_s: float | None = None
    force_n: float | None = None
    contact: bool = True
    button: bool = False


@dataclass(frozen=True)
class ConnectedDevice:
    """A device that is connected, and may measure a hand.

    Parameters
    ----------
    kind : str
        "tablet", "mouse", "serial" or "other".
    readable : bool
        Whether this user may read it.
    """

    path: str
    name: str
    kind: str
    readable: bool

    def __str__(self) -> str:
        return f"{self.name} ({self.path}, {self.kind})"


class DeviceLost(Exception):
    """The device is gone, or sends nothing that can be used; the message is one sentence."""


class Device(Protocol):
    """An open device that measures the hand."""

    name: str
    rest_s: float  # silent for this long, it rests (tracking.REST_S where it reports only changes)

    @property
    def firmware(self) -> str:
        """The version that the device stated; empty where it states none, or has not yet."""

    def wait(self, seconds: float) -> None:
        """Return when there may be something to read, at the latest after this time."""

    def read(self) -> list[Sample]:
        """All samples since the last call, without waiting; DeviceLost where it is gone."""

    def counts(self) -> dict[str, int]:
        """What was read so far and what was lost, by name; empty where nothing can be lost.

        "late": read, but so long after it was measured that it was dropped.
        """

    def close(self) -> None:
        """Give the device back."""
