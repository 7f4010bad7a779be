"""What measures the hand: the [hand] of a rig file, in plain numbers."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import isfinite

from tactileq.modeling.checks import (
    check_choice,
    check_name,
    check_number,
    check_whole,
    is_number,
)
from tactileq.modeling.errors import InputError, shown

KINDS = ("tablet", "mouse", "serial", "window", "scripted", "force")
SCRIPTS = ("strokes", "hold")

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True, kw_only=True)
class HandSettings:
    """What measures the hand, and what is assumed where it measures nothing.

    Parameters
    ----------
    kind : str
        "tablet", "mouse", "serial", "window" (positions pushed by who owns it) or "scripted" (the
        test source, whose readings are marked simulated).
    device : str, optional
        Path or name of a tablet or mouse (a name outlives plugging it in again), path of a serial
        port. Without it, the only one that fits.
    counts_per_mm : float, optional
        Steps of the device in 1 mm, or pixels of the window. A tablet mostly states its own.
    filter_delay_s : float
        Delay of the tracking filter (docs/method/hand.md#delay).
    assumed_force_n : float, optional
        Where no force is measured; every reading says so.
    pressure_points : tuple of (float, float), optional
        Pressure as a share (0–1) of a tablet's range, and the force in N; straight lines between
        (docs/method/hand.md#pressure).
    contact_n : float
        Below this measured force the hand does not touch.
    baud : int
        Of a serial port.
    grab : bool
        Whether no other program gets the device's movements, so that the pointer does not move.
    script : str
        Of a scripted hand: "strokes" (back and forth as a sine, up to `speed_mm_s`), "hold"
        (constant) or the path of a table (time_s, x_mm, y_mm, force_n), which is played once.
    speed_mm_s, force_n, strokes_per_s : float
        Of the scripts "strokes" and "hold".

    Raises
    ------
    InputError
    """

    kind: str
    device: str | None = None
    counts_per_mm: float | None = None
    filter_delay_s: float = 0.01
    assumed_force_n: float | None = None
    pressure_points: Points | None = None
    contact_n: float = 0.05
    baud: int = 115200
    grab: bool = False
    script: str = "strokes"
    speed_mm_s: float = 150.0
    force_n: float = 1.5
    strokes_per_s: float = 1.0

    def __post_init__(self) -> None:
        check_choice("the kind of hand", self.kind, KINDS)
        if self.device is not None:
            check_name("the device of the hand", self.device)
        for name, low, high in (
            ("filter_delay_s", 0.0005, 0.1),
            ("contact_n", 0.0, 5.0),
            ("speed_mm_s", -2000.0, 2000.0),
            ("force_n", 0.0, 20.0),
            ("strokes_per_s", 0.01, 20.0),
        ):
            check_number(name, getattr(self, name), low=low, high=high)
        for name, low, high in (("counts_per_mm", 0.01, 1e5), ("assumed_force_n", 0.0, 20.0)):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), low=low, high=high)
        check_whole("baud", self.baud, low=1200, high=12_000_000)
        self._check_what_is_assumed()
        if self.pressure_points is not None:
            check_points(self.pressure_points)

    def _check_what_is_assumed(self) -> None:
        if self.kind in ("mouse", "window"):
            self._require("counts_per_mm", "how many steps or pixels are 1 mm")
        if self.kind in ("mouse", "window") or self.without_pressure:
            self._require("assumed_force_n", "which nothing measures here")

    @property
    def without_pressure(self) -> bool:
        """Whether this is a tablet whose pressure has not been calibrated."""
        return self.kind == "tablet" and self.pressure_points is None

    def _require(self, name: str, why: str) -> None:
        if getattr(self, name) is None:
            raise InputError(
                f"expected {name} of a {self.kind} ({why}), got none; give it under [hand]."
            )


def check_points(points: object) -> None:
    """Refuse all but two or more points of rising pressure (a share) and rising force (N, ≥ 0)."""
    if not isinstance(points, tuple) or len(points) < 2 or not all(map(_is_point, points)):
        raise InputError(
            "expected at least two points (pressure as a share, N) of a pressure curve, got "
            f"{shown(points)}; calibrate the pressure."
        )
    pairs = pairwise(points)
    if points[0][1] < 0 or any(b[0] <= a[0] or b[1] < a[1] for a, b in pairs):
        raise InputError(
            "expected rising pressure and force from 0 N up in a pressure curve, got "
            f"{shown(points)}; sort the points, or calibrate again."
        )


def _is_point(point: object) -> bool:
    return (
        isinstance(point, tuple)
        and len(point) == 2
        and all(is_number(value) and isfinite(value) for value in point)
    )
