"""The grid of conditions over the range of one toolkit file.

docs/method/rig.md#toolkit-files
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats
from tactileq.rig.recording.importing.hatt import HattTexture

NODES_PER_AXIS = 7
# Values whose range is a smaller share of the highest are one: nodes between them would all be
# the same condition.
_SAME = 1e-3


@dataclass(frozen=True)
class GridAxis:
    """Speeds (mm/s) or forces (N) of a grid, and how they are spaced.

    Parameters
    ----------
    values : tuple of float
        > 0.
    spacing : {"linear", "logarithmic", "single", "given"}
        By equal steps, by equal ratios, one value only, or as somebody chose them.
    """

    values: tuple[float, ...]
    spacing: str

    def describe(self, what: str, unit: str) -> str:
        """One phrase: number, range and spacing."""
        low, high = min(self.values), max(self.values)
        if len(self.values) == 1:
            return f"1 {what} of {low:.4g} {unit}"
        return f"{len(self.values)} {what}s of {low:.4g} to {high:.4g} {unit} ({self.spacing})"


@dataclass(frozen=True)
class ToolkitGrid:
    """A grid laid over one file, and how many of its nodes the file covers.

    Parameters
    ----------
    inside : int
        Number of nodes within the hull of the file's triangles, and with vibration.
    """

    speeds: GridAxis
    forces: GridAxis
    inside: int

    @property
    def conditions(self) -> list[tuple[float, float]]:
        """Speed and force of each node, speed by speed."""
        return list(product(self.speeds.values, self.forces.values))

    def describe(self) -> str:
        """One phrase: both axes, and how many of the nodes are covered."""
        return (
            f"{self.speeds.describe('speed', 'mm/s')} x {self.forces.describe('force', 'N')}, "
            f"{self.inside} of {len(self.conditions)} nodes within the hull of its models"
        )


def spanning_grid(
    texture: HattTexture,
    *,
    speeds_mm_s: Sequence[float] | None = None,
    forces_n: Sequence[float] | None = None,
) -> ToolkitGrid:
    """The grid over the range of a file's conditions of which most nodes lie within its hull.

    An axis goes from the lowest to the highest value of the filters with vibration, by equal
    steps or by equal ratios; of these grids the one with most nodes within the hull is taken, and
    equal steps where as many are.

    Parameters
    ----------
    speeds_mm_s, forces_n : sequence of float, optional
        An axis to take as it is, > 0; by default 7 values over the file's range, or one where all
        filters have the same.

    Raises
    ------
    InputError
        For values out of range; where an axis is not given, also for a file without vibration or
        with all of it at one condition.
    """
    speeds, forces = _axes_of(texture, speeds_mm_s, forces_n)
    for speed, force in product(speeds[0].values, forces[0].values):
        texture.check_condition(speed, force)
    grids = [_covered(texture, *axes) for axes in product(speeds, forces)]
    return max(grids, key=lambda grid: grid.inside)  # the first one of several


def _axes_of(
    texture: HattTexture, speeds_mm_s: Sequence[float] | None, forces_n: Sequence[float] | None
) -> tuple[list[GridAxis], list[GridAxis]]:
    """What each axis may be."""
    if speeds_mm_s is not None and forces_n is not None:
        return [_given(speeds_mm_s)], [_given(forces_n)]
    speeds, forces = texture.conditions[texture.vibrating()].T
    if _coincide(speeds) and _coincide(forces):
        raise InputError(
            f"{texture.material}: expected models with vibration at two conditions or more, got "
            f"all of them at {speeds[0]:g} mm/s and {forces[0]:g} N; give speeds and forces, or "
            "take the file's own conditions."
        )
    return (
        _spanning(speeds) if speeds_mm_s is None else [_given(speeds_mm_s)],
        _spanning(forces) if forces_n is None else [_given(forces_n)],
    )


def _given(values: Sequence[float]) -> GridAxis:
    return GridAxis(tuple(map(float, values)), "given")


def _spanning(values: Floats) -> list[GridAxis]:
    """Axes over the range of some values, equal steps first."""
    low, high = float(values.min()), float(values.max())
    if _coincide(values):
        return [GridAxis((low,), "single")]
    return [
        GridAxis(tuple(np.linspace(low, high, NODES_PER_AXIS).tolist()), "linear"),
        GridAxis(tuple(np.geomspace(low, high, NODES_PER_AXIS).tolist()), "logarithmic"),
    ]


def _coincide(values: Floats) -> bool:
    return bool(np.ptp(values) <= _SAME * values.max())


def _covered(texture: HattTexture, speeds: GridAxis, forces: GridAxis) -> ToolkitGrid:
    grid = ToolkitGrid(speeds, forces, 0)
    return replace(grid, inside=len(texture.conditions_inside(grid.conditions)))
