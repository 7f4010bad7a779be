"""A recording: what an accelerometer on a tool measured in one condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.checks import (
    HIGHEST_FORCE_N,
    HIGHEST_SPEED_MM_S,
    LARGEST_VALUE,
    UNITS,
    check_rate,
    check_texture_name,
)
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.reprs import one_line

MIN_SAMPLES = 64


@dataclass(frozen=True, eq=False)
class Recording:
    """One record of tool vibration at one speed and one force.

    Parameters
    ----------
    samples : (n,) array_like
        Acceleration in `unit`; n ≥ 64, within ±1e100, not constant.
    rate_hz : float
        Sampling rate, > 0, up to 10 MHz.
    speed_mm_s, force_n : float
        Tangential speed (mm/s), 0 … 1e5, and normal force (N), 0 … 1e4. A force of 0 marks a
        no-contact recording, which gives the sensor's floor
        (docs/method/recordings.md#sensor-floor).
    texture : str
        Name of the surface.
    unit : {"g", "arbitrary"}
        `arbitrary` if the g per full scale is unknown; such records are never compared with
        a detection threshold.
    simulated : bool
        True if no real surface was touched.
    repeat : int
        1 for the first record of a condition, 2 for the second, …
    clipped_share : float
        Share (0–1) of the samples in which the sensor was at its limit; left out (NaN), it is
        counted in `samples`. Give it where they are no longer the sensor's own (DFT321).

    Raises
    ------
    InputError
        For anything outside these ranges.
    """

    samples: Floats
    rate_hz: float
    speed_mm_s: float
    force_n: float
    texture: str
    unit: str = "g"
    simulated: bool = False
    repeat: int = 1
    clipped_share: float = np.nan

    __repr__ = one_line

    def __post_init__(self) -> None:
        check_texture_name(self.texture)
        where = f"recording of {shown(self.texture)}"
        object.__setattr__(self, "samples", _checked_samples(self.samples, where))
        for name in ("rate_hz", "speed_mm_s", "force_n"):
            object.__setattr__(self, name, float(getattr(self, name)))
        try:
            check_rate(self.rate_hz)
            check_condition(self.speed_mm_s, self.force_n)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        if self.unit not in UNITS:
            raise InputError(
                f"{where}: expected a unit among {', '.join(UNITS)}, got {shown(self.unit)}; "
                "convert the data to g or call them arbitrary."
            )
        if self.repeat < 1:
            raise InputError(
                f"{where}: expected a repeat of at least 1, got {self.repeat}; fix it."
            )
        if np.isnan(self.clipped_share):
            object.__setattr__(self, "clipped_share", float(clipped_samples(self.samples).mean()))
        if not 0 <= self.clipped_share <= 1:
            raise InputError(
                f"{where}: expected a clipped_share of 0 to 1, got {self.clipped_share}; fix it."
            )

    @property
    def duration_s(self) -> float:
        """Length of the record in seconds."""
        return self.samples.size / self.rate_hz

    @property
    def condition(self) -> tuple[float, float]:
        """(speed in mm/s, force in N)."""
        return self.speed_mm_s, self.force_n

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Recording):
            return NotImplemented
        return self._labels() == other._labels() and np.array_equal(self.samples, other.samples)

    __hash__ = None  # type: ignore[assignment]

    def _labels(self) -> tuple[Any, ...]:
        return (
            self.rate_hz,
            *self.condition,
            self.texture,
            self.unit,
            self.simulated,
            self.repeat,
            self.clipped_share,
        )

    def describe(self) -> str:
        """One phrase that names the record, for messages."""
        repeat = f", repeat {self.repeat}" if self.repeat != 1 else ""
        return f"{self.texture} at {self.speed_mm_s:g} mm/s, {self.force_n:g} N{repeat}"


def check_condition(speed_mm_s: float, force_n: float) -> None:
    """Refuse a speed beyond 0 … 1e5 mm/s and a force beyond 0 … 1e4 N, NaN among them."""
    for name, value, unit, highest in (
        ("speed_mm_s", speed_mm_s, "mm/s", HIGHEST_SPEED_MM_S),
        ("force_n", force_n, "N", HIGHEST_FORCE_N),
    ):
        if not 0 <= value <= highest:
            raise InputError(
                f"expected {name} of at least 0 {unit} and at most {highest:g}, got {value:g}; "
                "correct it."
            )


def _checked_samples(samples: ArrayLike, where: str) -> Floats:
    array = np.array(samples, dtype=np.float64)
    if array.ndim != 1:
        raise InputError(
            f"{where}: expected one axis of samples, got an array of shape {array.shape}; "
            "choose an axis or combine them with DFT321."
        )
    if array.size < MIN_SAMPLES:
        raise InputError(
            f"{where}: expected at least {MIN_SAMPLES} samples, got {array.size}; record again."
        )
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise InputError(
            f"{where}: expected finite samples, got {bad.size} NaN or infinite ones, the first "
            f"at sample {bad[0]}; repair or record again."
        )
    if np.abs(array).max() > LARGEST_VALUE:
        raise InputError(
            f"{where}: expected samples within ±{LARGEST_VALUE:g}, got {np.abs(array).max():g}; "
            "repair or record again."
        )
    if np.ptp(array) == 0:
        raise InputError(
            f"{where}: expected a vibration, got the constant value {array[0]:g}; "
            "check the sensor and its cable."
        )
    array.setflags(write=False)
    return array


def clipped_samples(samples: Floats) -> Bools:
    """Which samples of one sensor axis are saturated at the highest or lowest value.

    An end counts, then with all its samples, where they pile up: more than twice as many as at
    the next three levels inwards together. A quantised sinusoid's highest level holds as many as
    those three, noise has fewer the further out. A level of more than half the samples is rest.

    Parameters
    ----------
    samples : (n,) ndarray
        Finite, as the sensor gave them: before any filter or combination.

    Returns
    -------
    (n,) ndarray of bool
    """
    # Rounded, so that rounding errors do not split one level into many.
    rounded = np.round(samples / (np.abs(samples).max() or 1.0), 9)
    levels, counts = np.unique(rounded, return_counts=True)
    stuck = np.zeros(samples.size, dtype=np.bool_)
    for end, inwards in ((0, counts[1:4]), (-1, counts[-4:-1])):
        if 2 * inwards.sum() < counts[end] <= samples.size / 2:
            stuck |= rounded == levels[end]
    return stuck
