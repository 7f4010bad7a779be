"""The walls of a study on a rig's force device: one for each texture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product

from tactileq.modeling import InputError
from tactileq.rig.machines.force.wall import SLOWEST, Wall, largest_stiffness_n_per_mm
from tactileq.rig.shared.setup.force_sections import ForceSection
from tactileq.rig.shared.setup.rig_file import RigFile

MARGIN = 0.5  # of the largest stiffness, where nothing says which
USUAL_MM = 100.0
DEVICE_WALL_MM = -50.0  # height of the wall's frame in that of a device that renders by itself
Millimetres = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Walls:
    """The wall under each texture.

    Parameters
    ----------
    usual : Wall
        Under a texture that has none of its own.
    by_texture : mapping of texture name to Wall
    """

    usual: Wall
    by_texture: Mapping[str, Wall] = field(default_factory=dict)

    def of(self, texture: str) -> Wall:
        """Under this texture."""
        return self.by_texture.get(texture, self.usual)

    def named(self) -> dict[str, Wall]:
        """Each wall by what it is called in a sentence."""
        own = {f"the wall under {texture}": wall for texture, wall in self.by_texture.items()}
        return {"the wall": self.usual, **own}


def usual_wall(rig: RigFile) -> Wall:
    """A wall like the real surface: as far above it as the rig file says, and as stiff.

    Where its stiffness was not measured, half of the largest that is passive.

    Raises
    ------
    InputError
        For a rig without a force device.
    """
    real = rig.real_surface
    largest = largest_of(rig)
    return Wall(
        height_mm=0.0 if real.offset_mm is None else real.offset_mm.value,
        stiffness_n_per_mm=(
            MARGIN * max(1e-3, largest) if real.stiffness is None else real.stiffness.value
        ),
        width_mm=USUAL_MM,
        length_mm=USUAL_MM,
    )


def largest_of(rig: RigFile, *, wall_damping_n_s_per_m: float = 0.0) -> float:
    """Stiffness (N/mm) up to which this rig's walls are passive.

    A servo lets go where its periods are too long on average, and has to be passive up to there,
    for SLOWEST nominal ones; a device that renders by itself has a timer.

    Raises
    ------
    InputError
        For a rig without a force device.
    """
    force = _force(rig)
    return largest_stiffness_n_per_mm(
        rate_hz=force.rate_hz / (SLOWEST if rig.own_device is None else 1),
        damping_n_s_per_m=force.damping.value,
        delay_s=1e-3 * force.delay_ms.value,
        wall_damping_n_s_per_m=wall_damping_n_s_per_m,
    )


def check_walls(rig: RigFile, walls: Walls, *, override: str | None = None) -> None:
    """Refuse walls that a rig's device cannot render.

    Parameters
    ----------
    override : str, optional
        Reason to use a wall although it is stiffer than the passivity bound.

    Raises
    ------
    InputError
        For a wall that reaches out of the workspace, or a stiffer one than is passive.
    """
    force = _force(rig)
    for name, wall in walls.named().items():
        _check_within(rig, force, wall, name)
        if override is None:
            _check_passive(rig, wall, name)


def _force(rig: RigFile) -> ForceSection:
    if rig.force_device is None:
        raise InputError(
            f'expected a force device for a wall, got hand.kind = "{rig.hand.kind}" in {rig.path}; '
            "use a rig with [force], or remove [wall] from the study file."
        )
    return rig.force_device


def _check_within(rig: RigFile, force: ForceSection, wall: Wall, name: str) -> None:
    """Refuse a wall of which a corner lies outside the workspace."""
    for x, y in product((-0.5, 0.5), repeat=2):
        corner = in_device(rig, (x * wall.width_mm, y * wall.length_mm, wall.height_mm))
        for axis, at, low, high in zip("xyz", corner, force.low_mm, force.high_mm, strict=True):
            if not low <= at <= high:
                raise InputError(
                    f"expected {name} within the workspace of the force device, got a corner at "
                    f"{axis} = {at:.0f} mm (from {low:g} to {high:g} mm); make it smaller, or "
                    "change its height or the pose."
                )


def _check_passive(rig: RigFile, wall: Wall, name: str) -> None:
    """Refuse a wall that is stiffer than is passive, and say how stiff it may be."""
    largest = largest_of(rig, wall_damping_n_s_per_m=wall.damping_n_s_per_m)
    own = _force(rig).damping.value
    if wall.stiffness_n_per_mm <= largest:
        return
    raise InputError(
        f"expected {name} to be passive on this device, got {wall.stiffness_n_per_mm:g} N/mm with "
        f"a damper of {wall.damping_n_s_per_m:g} N·s/m; "
        + (
            f"at most {_floored(largest):g} N/mm holds, or give --override with a reason, which is "
            "stored."
            if largest > 0
            else f"its damper may have less than the device's own {own:g} N·s/m."
        )
    )


def _floored(value: float) -> float:
    """To four digits, and never more than it is."""
    rounded = float(f"{value:.4g}")
    return rounded if rounded <= value else float(f"{value * (1 - 1e-4):.4g}")


def in_device(rig: RigFile, point_mm: Millimetres) -> Millimetres:
    """A point of the wall's frame in the frame of the device."""
    pose = rig.pose
    if rig.own_device is not None:
        return point_mm[0], point_mm[1], point_mm[2] + DEVICE_WALL_MM
    if pose is None:
        return point_mm
    x, y, z = (
        pose.origin_mm[axis]
        + point_mm[0] * pose.x[axis]
        + point_mm[1] * pose.y[axis]
        + point_mm[2] * pose.z[axis]
        for axis in range(3)
    )
    return x, y, z
