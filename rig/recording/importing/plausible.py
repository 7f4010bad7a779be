"""Recordings with implausible labels, unit or scale, and what else these may mean.

docs/method/recordings.md#implausible-imports
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tactileq.modeling import Recording
from tactileq.modeling.perception.thresholds import STANDARD_GRAVITY_M_S2


class Range(NamedTuple):
    """A plausible range, both ends included."""

    lowest: float
    highest: float

    def holds(self, value: float) -> bool:
        """Whether a value lies in it."""
        return self.lowest <= value <= self.highest


# A factor of about 4 beyond what 100 measured textures have (1232 conditions): 11 to 308 mm/s,
# 0.05 to 8.3 N, up to 2.1 g RMS.
SPEEDS_MM_S = Range(3.0, 1500.0)
FORCES_N = Range(0.01, 30.0)
HIGHEST_LEVEL_G = 8.0
LOWEST_LEVEL_G = 1e-4  # below the noise of accelerometers for tools
LEVELS_G = Range(LOWEST_LEVEL_G, HIGHEST_LEVEL_G)
# From an amplified sensor of ±2 g to a shock sensor.
SCALES_G = Range(0.1, 2000.0)
# Gravity is 1 g, or 9.81 m/s²; what else is constant is an offset of the sensor.
HIGHEST_GRAVITY_G = 1.5
GRAVITIES_M_S2 = Range(HIGHEST_GRAVITY_G, 11.0)  # numbers that only m/s² explains

G_PER_UNIT: Mapping[str, float] = {
    "g": 1.0,
    "mg": 1e-3,
    "m/s2": 1 / STANDARD_GRAVITY_M_S2,
    "arbitrary": 1.0,
}
_READINGS = {"g": "g", "m/s2": "m/s²", "mg": "mg"}
_SCALES_IN_G = {
    "in m/s²": G_PER_UNIT["m/s2"],
    "in mg": G_PER_UNIT["mg"],
    "per count of 16 bits": 2.0**15,
    "per count of 24 bits": 2.0**23,
}
GO_ON = "or give --yes if it is intended (in Python take import_wav_file or import_csv_file)"


def doubts_about(
    recording: Recording, name: str, *, unit: str = "g", g_per_fullscale: float | None = None
) -> tuple[str, ...]:
    """What is implausible about a recording, one sentence each, with what else it may mean.

    Parameters
    ----------
    name : str
        Of its file, for the sentence.
    unit : {"g", "mg", "m/s2", "arbitrary"}
        In which its numbers were taken to be.
    g_per_fullscale : float, optional
        By which its numbers were multiplied.
    """
    found = [_condition_doubt(*recording.condition)]
    found.append("" if g_per_fullscale is None else _scale_doubt(g_per_fullscale))
    if recording.unit == "g" and not found[-1]:
        found.append(
            _level_doubt(recording, unit, g_per_fullscale) or _gravity_doubt(recording, unit)
        )
    return tuple(f"{name}: {doubt}" for doubt in found if doubt)


def _condition_doubt(speed_mm_s: float, force_n: float) -> str:
    if _is_condition(speed_mm_s, force_n):
        return ""
    others = {
        "with the columns swapped": (force_n, speed_mm_s),
        "with the speed in m/s": (1000 * speed_mm_s, force_n),
        "with the force in mN": (speed_mm_s, force_n / 1000),
        "with m/s and mN": (1000 * speed_mm_s, force_n / 1000),
    }
    fitting = [
        f", or {speed:g} mm/s and {force:g} N {how}"
        for how, (speed, force) in others.items()
        if _is_condition(speed, force)
    ]
    return (
        f"expected a speed from {SPEEDS_MM_S.lowest:g} to {SPEEDS_MM_S.highest:g} mm/s and a force "
        f"from {FORCES_N.lowest:g} to {FORCES_N.highest:g} N, got {speed_mm_s:g} mm/s and "
        f"{force_n:g} N{''.join(fitting[:1])}; correct them, {GO_ON}."
    )


def _is_condition(speed_mm_s: float, force_n: float) -> bool:
    """Whether both are in their ranges; 0 is a hand at rest, or no contact."""
    return (speed_mm_s == 0 or SPEEDS_MM_S.holds(speed_mm_s)) and (
        force_n == 0 or FORCES_N.holds(force_n)
    )


def _scale_doubt(g: float) -> str:
    if SCALES_G.holds(g):
        return ""
    fitting = [
        f", or {g * factor:.4g} g where {g:g} is {how}"
        for how, factor in _SCALES_IN_G.items()
        if SCALES_G.holds(g * factor)
    ]
    return (
        f"expected {SCALES_G.lowest:g} to {SCALES_G.highest:g} g per full scale, got {g:g} g"
        f"{''.join(fitting[:1])}; correct --g-per-fullscale or its column, {GO_ON}."
    )


def _level_doubt(recording: Recording, unit: str, g_per_fullscale: float | None) -> str:
    level_g = float(np.std(recording.samples))
    # At rest, or without contact, a sensor may be as silent as it likes.
    is_at_rest = 0 in (recording.speed_mm_s, recording.force_n)
    if LEVELS_G.holds(level_g) or (is_at_rest and level_g < LOWEST_LEVEL_G):
        return ""
    what = "its numbers" if g_per_fullscale is None else "g per full scale"
    fitting = [
        f", or {level_g * G_PER_UNIT[other] / G_PER_UNIT[unit]:.3g} g with {what} in {written}"
        for other, written in _READINGS.items()
        if LEVELS_G.holds(level_g * G_PER_UNIT[other] / G_PER_UNIT[unit])
    ]
    return (
        f"expected a vibration from {LOWEST_LEVEL_G:g} to {HIGHEST_LEVEL_G:g} g RMS, got "
        f"{level_g:.3g} g with {what} in {_READINGS[unit]}{''.join(fitting[:1])}; correct the unit "
        f"or the scale, {GO_ON}."
    )


def _gravity_doubt(recording: Recording, unit: str) -> str:
    constant_g = abs(float(np.mean(recording.samples)))
    # The mean of a strong vibration is uncertain, and says less than its level.
    is_constant = constant_g > np.std(recording.samples)
    if unit != "g" or not is_constant or not GRAVITIES_M_S2.holds(constant_g):
        return ""
    return (
        f"expected a constant part of at most {HIGHEST_GRAVITY_G:g} g, as gravity gives, got "
        f"{constant_g:.3g} g with its numbers in g, or {constant_g * G_PER_UNIT['m/s2']:.3g} g "
        f"with them in m/s²; correct the unit in the header or --unit, {GO_ON}."
    )
