"""From samples of a device to readings of the hand: speed, force, and what is assumed."""

from __future__ import annotations

from math import isfinite, nan
from typing import NamedTuple

from tactileq.rig.devices.hand.sample import DeviceLost, Sample
from tactileq.rig.devices.hand.settings import HandSettings
from tactileq.rig.devices.hand.tracking import TrackingFilter
from tactileq.rig.shared.live.memory import BUTTON, CONTACT, FORCE_ASSUMED, GONE, SIMULATED, Live


class Reading(NamedTuple):
    """One reading of the hand, as `Live` keeps it."""

    time_s: float
    x_mm: float
    y_mm: float
    speed_mm_s: float
    force_n: float
    flags: int

    def write(self, live: Live) -> None:
        """Into the memory that all processes share."""
        live.write_reading(
            self.time_s,
            self.x_mm,
            y_mm=self.y_mm,
            speed_mm_s=self.speed_mm_s,
            force_n=self.force_n,
            flags=self.flags,
        )


class Follower:
    """Follows a hand from sample to sample.

    Parameters
    ----------
    rest_s : float
        A device that has been silent for this long rests (`Device.rest_s`).
    """

    def __init__(self, settings: HandSettings, *, rest_s: float) -> None:
        self._settings = settings
        self._filter = TrackingFilter(settings.filter_delay_s, rest_s=rest_s)
        self._rest_s = rest_s
        self._sample: Sample | None = None
        self._always = SIMULATED if settings.kind == "scripted" else 0

    def update(self, sample: Sample) -> Reading:
        """The reading that a sample gives.

        Raises
        ------
        DeviceLost
            If force is neither measured nor assumed.
        """
        self._sample = sample
        speed = sample.speed_mm_s
        if speed is None:
            speed = self._filter.update(sample.time_s, sample.x_mm, sample.y_mm)
        return self._reading(sample, sample.time_s, speed_mm_s=speed)

    def at(self, time_s: float) -> Reading | None:
        """The reading at a later moment at which the device has said nothing new.

        None while the hand is likely to have moved on: what is rendered extrapolates from the last
        sample. That is while it touches, for half of the time after which the device rests.
        """
        sample = self._sample
        if sample is None:
            return Reading(time_s, nan, nan, 0.0, 0.0, self._always)
        speed = sample.speed_mm_s
        if speed is None:
            speed = self._filter.at(time_s)
        reading = self._reading(sample, time_s, speed_mm_s=speed)
        moves_on = reading.flags & CONTACT and time_s - sample.time_s <= self._rest_s / 2
        return None if moves_on else reading

    def gone(self, time_s: float) -> Reading:
        """The reading without a device: nothing moves, nothing touches."""
        self._sample = None
        self._filter.reset()
        return Reading(time_s, nan, nan, 0.0, 0.0, GONE | self._always)

    def _reading(self, sample: Sample, time_s: float, *, speed_mm_s: float) -> Reading:
        force_n, assumed = self._force(sample)
        touches = sample.contact and (assumed or force_n >= self._settings.contact_n)
        flags = (
            self._always
            | (CONTACT if touches and force_n > 0 else 0)
            | (BUTTON if sample.button else 0)
            | (FORCE_ASSUMED if assumed else 0)
        )
        x_mm, y_mm = (v if isfinite(v) else nan for v in (sample.x_mm, sample.y_mm))
        return Reading(time_s, x_mm, y_mm, speed_mm_s, force_n if flags & CONTACT else 0.0, flags)

    def _force(self, sample: Sample) -> tuple[float, bool]:
        if sample.force_n is not None:
            return sample.force_n, False
        if self._settings.assumed_force_n is None:
            raise DeviceLost(
                "expected force from the device of the hand, got none; give assumed_force_n under "
                "[hand], or a device that measures it."
            )
        return self._settings.assumed_force_n, True
