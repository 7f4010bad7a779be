"""Stiffness of a surface, virtual or real: a force device presses on it by itself."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sin

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.rig.machines.force.hand import ForceHand
from tactileq.rig.machines.force.states import State
from tactileq.rig.machines.force.wall import LARGEST_MM, Wall
from tactileq.rig.shared.live.memory import Live

PRESS_S = 4.0  # up and down again
SHARE = 0.6  # of the largest force of the device
LEAST_SHARE = 0.2  # of the largest press: below, the tool may not yet rest on the surface
LEAST_MM = 0.05
LEAST_FIT = 0.9
TOLERANCE = 0.1  # of a wall's stiffness, beside what is measured inexactly
_EVERY_S = 0.002
# Nothing to be felt: for the real surface.
NO_WALL = Wall(height_mm=-LARGEST_MM, stiffness_n_per_mm=1e-3, width_mm=1.0, length_mm=1.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Pressed:
    """Force against depth of one surface.

    Parameters
    ----------
    force_n, depth_mm : (n,) ndarray
        Commanded force into the surface, and how far the tool went down since it rested on it.
    stiffness_n_per_mm, friction_n : float
        Of the surface; half of the difference between loading and unloading.
    uncertainty_n_per_mm : float
        Of the stiffness: half of the difference between those of loading and unloading.
    simulated : bool
    """

    force_n: Floats
    depth_mm: Floats
    stiffness_n_per_mm: float
    friction_n: float
    uncertainty_n_per_mm: float
    simulated: bool


def armed_at(live: Live, hand: ForceHand) -> float:
    """Arm, and show a wall that nobody feels; the tool's height (mm), along the frame's z.

    Raises
    ------
    InputError
        If the device has a fault, and which.
    """
    hand.arm()
    live.heartbeat()
    hand.show(NO_WALL)
    return NO_WALL.height_mm - hand.control.depth_mm


def press_on(
    live: Live,
    hand: ForceHand,
    *,
    wall_n_per_mm: float | None,
    most_n: float,
    simulated: bool,
    tick: Callable[[float], None],
) -> Pressed:
    """Press with a rising and falling force, and watch the depth; nobody may hold the tool.

    Parameters
    ----------
    wall_n_per_mm : float, optional
        Of the virtual wall, which begins where the tool is now; None presses on the real surface.
    most_n : float
        Largest press.
    tick : callable
        Takes the share that is done.

    Raises
    ------
    InputError
        If the device lets go, or the surface does not give way like a spring.
    """
    wall, start_mm = NO_WALL, armed_at(live, hand)
    if wall_n_per_mm is not None:
        hand.hide()
        wall = Wall(height_mm=start_mm, stiffness_n_per_mm=wall_n_per_mm)
        hand.show(wall)
    forces, depths = [], []
    begin_s = time.monotonic()
    try:
        while (share := (time.monotonic() - begin_s) / PRESS_S) < 1:
            live.heartbeat()
            force = most_n * sin(pi * share) ** 2
            hand.control.press(force)
            tick(share)
            time.sleep(_EVERY_S)
            if (status := hand.status).state != State.RUNNING:
                raise InputError(status.sentence)
            forces.append(force)
            depths.append(hand.control.depth_mm - wall.height_mm + start_mm)
    finally:
        hand.control.press(0.0)
        hand.hide()
    return pressed(np.array(forces), np.array(depths), simulated=simulated)


def pressed(force_n: Floats, depth_mm: Floats, *, simulated: bool) -> Pressed:
    """The stiffness by least squares of depth on force, over loading and unloading.

    Friction holds the tool up while it goes down and down while it comes up; the mean of both
    slopes is free of it.

    Raises
    ------
    InputError
        If the depth does not follow the force.
    """
    turn = int(np.argmax(force_n))
    used = force_n > LEAST_SHARE * force_n.max()
    loading = np.arange(force_n.size) <= turn
    fits = []
    for part in (used & loading, used & ~loading):
        slope, offset = np.polyfit(force_n[part], depth_mm[part], 1)
        fits.append((float(slope), float(offset)))
    compliance = (fits[0][0] + fits[1][0]) / 2
    moved = float(np.ptp(depth_mm[used]))
    likeness = float(np.corrcoef(force_n[used], depth_mm[used])[0, 1]) if moved > 0 else 0.0
    if moved < LEAST_MM or compliance <= 0 or likeness < LEAST_FIT:
        raise InputError(
            f"expected a surface that gives way like a spring, got {moved:.2f} mm under "
            f"{force_n.max():.2f} N (correlation {likeness:.2f}); rest the tool on it, let go, and "
            "see whether it is a surface on springs."
        )
    return Pressed(
        force_n=force_n,
        depth_mm=depth_mm,
        stiffness_n_per_mm=1 / compliance,
        friction_n=abs(fits[1][1] - fits[0][1]) / 2 / compliance,
        uncertainty_n_per_mm=abs(fits[1][0] - fits[0][0]) / 2 / compliance**2,
        simulated=simulated,
    )


def is_commanded(found: float, commanded: float, *, within: float) -> bool:
    """Whether a stiffness is the one that was commanded, but for TOLERANCE and its uncertainty."""
    return abs(found - commanded) <= TOLERANCE * commanded + within


def check_virtual(virtual: Pressed, *, commanded_n_per_mm: float) -> None:
    """Refuse a virtual wall that is not as stiff as was commanded: something else bears the tool.

    Raises
    ------
    InputError
    """
    found, likely = virtual.stiffness_n_per_mm, virtual.uncertainty_n_per_mm
    if is_commanded(found, commanded_n_per_mm, within=likely):
        return
    raise InputError(
        f"expected about {commanded_n_per_mm:.3g} N/mm of the virtual wall, as commanded, got "
        f"{found:.3g} N/mm; the tool rests on something else, too, such as the real surface, or "
        "somebody holds it: hold it higher in the air, let go, and begin again."
    )
