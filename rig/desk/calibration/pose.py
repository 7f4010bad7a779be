"""Where a wall lies in the frame of a force device: from three points that are touched."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.rig.desk.parts import force_settings, hand_settings
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.settings import Pose
from tactileq.rig.shared.live.memory import GONE, Live
from tactileq.rig.shared.setup.force_sections import PoseSection
from tactileq.rig.shared.setup.rig_file import RigFile

SHORTEST_MM = 20.0
LEAST_SINE = 0.3
STILL_MM = 1.0
POINT_S = 0.5
UNHELD_S = 60.0


def touching_hand(rig: RigFile, live: Live) -> ForceHand:
    """The force device in its own frame, not armed.

    Nobody has to hold it: readings may be the same for as long as they like.

    Raises
    ------
    InputError
        For a rig without one.
    """
    settings = force_settings(rig, sounds=False)
    if rig.own_device is not None:
        raise InputError(
            f"expected a force device that can press, got [device] in {rig.path}, whose cables "
            "only pull and whose wall lies where its firmware says; measure by other means (a "
            "spring balance for real_surface.stiffness), and write it yourself."
        )
    if settings is None:
        raise InputError(
            f'expected a force device, got hand.kind = "{rig.hand.kind}" in {rig.path}; nothing '
            "else has a pose."
        )
    return ForceHand(live, hand_settings(rig), replace(settings, pose=Pose(), frozen_s=UNHELD_S))


@dataclass(frozen=True, kw_only=True)
class Touched:
    """A point that the tool touched, in the device's frame (mm), and the way to it.

    Parameters
    ----------
    point_mm : (3,) ndarray
    way_mm : (n, 3) ndarray
        Where the tool was since the point before.
    """

    point_mm: Floats
    way_mm: Floats


def touched(live: Live, since: int, *, seconds: float = POINT_S) -> tuple[int, Touched]:
    """Where the tool rests now, and how many readings there were until then.

    Parameters
    ----------
    since : int
        How many there were at the point before.

    Raises
    ------
    InputError
        If it moves, or the device says nothing.
    """
    begins = live.readings_written
    time.sleep(seconds)
    ends, rows = live.readings_since(since)
    rows = rows[(rows["flags"] & GONE) == 0]
    resting = rows[-max(1, ends - begins) :]
    if not resting.size:
        raise InputError("expected readings of the force device, got none; see whether it is on.")
    every = np.column_stack([rows["x_mm"], rows["y_mm"], -rows["depth_mm"]])
    still = every[-resting.size :]
    spread = float(np.ptp(still, axis=0).max())
    if spread > STILL_MM:
        raise InputError(
            f"expected a tool that rests on the point, got one that moved by {spread:.1f} mm; hold "
            "it still, and begin again."
        )
    return ends, Touched(point_mm=still.mean(axis=0), way_mm=every)


def pose_of(points: tuple[Touched, Touched, Touched], *, today: date) -> PoseSection:
    """The frame with its origin at the first point, x to the second, the third in its plane.

    z points to the side on which the tool was between the points.

    Raises
    ------
    InputError
        For points too near each other, or in one line.
    """
    first, second, third = (point.point_mm for point in points)
    along, across = second - first, third - first
    lengths = float(np.linalg.norm(along)), float(np.linalg.norm(across))
    if min(lengths) < SHORTEST_MM:
        raise InputError(
            f"expected points at least {SHORTEST_MM:g} mm apart, got {min(lengths):.1f} mm; touch "
            "points further apart."
        )
    normal = np.cross(along, across)
    sine = float(np.linalg.norm(normal)) / (lengths[0] * lengths[1])
    if sine < LEAST_SINE:
        raise InputError(
            f"expected three points that are not in one line, got an angle of "
            f"{np.degrees(np.arcsin(sine)):.0f}°; touch the third one beside the line."
        )
    z = normal / np.linalg.norm(normal)
    between = np.concatenate([point.way_mm for point in points[1:]]) - first
    if float((between @ z).mean()) < 0:
        z = -z
    x = along / lengths[0]

    def rounded(vector: Floats, digits: int) -> tuple[float, float, float]:
        a, b, c = (round(float(value), digits) for value in vector)
        return a, b, c

    return PoseSection(
        origin_mm=rounded(first, 3), x=rounded(x, 6), z=rounded(z, 6), measured_on=today
    )
