"""Two motors that pull one tool by two cables: where it is, how it moves, what may pull on it.

docs/cable-device.md#geometry
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_number
from tactileq.modeling.errors import InputError

LEAST_DEPTH_MM = 1.0  # below the motors; at their height the cables are in line


@dataclass(frozen=True, eq=False, kw_only=True)
class Pull:
    """What two cables can give of a force.

    Parameters
    ----------
    tensions_n : (2,) ndarray
        Of the left and of the right cable.
    force_n : (2,) ndarray
        On the tool, along x and upwards.
    clipped : bool
        Whether this is not the force that was asked for.
    """

    tensions_n: Floats
    force_n: Floats
    clipped: bool


@dataclass(frozen=True, kw_only=True)
class CableGeometry:
    """The motors stand at (−a, 0) and (a, 0), z points upwards; the tool hangs below them.

    Parameters
    ----------
    half_mm : float
        a, above 0.
    low_x_mm, high_x_mm, low_z_mm, high_z_mm : float
        Workspace.
    least_n, most_n : float
        Tension of a cable: below the least one it is slack. 0 ≤ least < most.

    Raises
    ------
    InputError
        For a workspace in which the cables cannot pull: beside the motors, or as high as they are.
    """

    half_mm: float = 300.0
    low_x_mm: float = -200.0
    high_x_mm: float = 200.0
    low_z_mm: float = -140.0
    high_z_mm: float = -20.0
    least_n: float = 0.2
    most_n: float = 16.0

    def __post_init__(self) -> None:
        check_number("half_mm", self.half_mm, low=1.0, high=5000.0)
        for name in ("low_x_mm", "high_x_mm", "low_z_mm", "high_z_mm"):
            check_number(name, getattr(self, name), low=-5000.0, high=5000.0)
        if not (-self.half_mm < self.low_x_mm < self.high_x_mm < self.half_mm):
            raise InputError(
                f"expected a workspace between the motors at ±{self.half_mm:g} mm, where both "
                f"cables pull upwards, got x from {self.low_x_mm:g} to {self.high_x_mm:g} mm; make "
                "it narrower, or put the motors further apart."
            )
        if not (self.low_z_mm < self.high_z_mm <= -LEAST_DEPTH_MM):
            raise InputError(
                f"expected a workspace below the motors (z = 0), where the cables can pull, got z "
                f"from {self.low_z_mm:g} to {self.high_z_mm:g} mm; lower it, at least to "
                f"{-LEAST_DEPTH_MM:g} mm."
            )
        check_number("least_n", self.least_n, low=0.0, high=1000.0)
        if not self.least_n < self.most_n < np.inf:
            raise InputError(
                f"expected a largest tension above the least one, {self.least_n:g} N, got "
                f"{self.most_n:g} N; a cable could not pull."
            )

    # --- Kinematics ---------------------------------------------------------------------------

    def lengths_mm(self, place_mm: ArrayLike) -> Floats:
        """Of both cables for a tool at (x, z), (…, 2) to (…, 2)."""
        place = np.asarray(place_mm, dtype=np.float64)
        along = place[..., :1] + np.array([self.half_mm, -self.half_mm])
        lengths: Floats = np.hypot(along, place[..., 1:])
        return lengths

    def place_mm(self, lengths_mm: ArrayLike) -> Floats:
        """Where the tool is for these lengths, (…, 2) to (…, 2).

        Raises
        ------
        InputError
            For lengths at which no tool can hang.
        """
        left, right = np.moveaxis(np.asarray(lengths_mm, dtype=np.float64), -1, 0)
        x = (left - right) * (left + right) / (4 * self.half_mm)
        square = (left - (x + self.half_mm)) * (left + (x + self.half_mm))
        if not np.all(square >= LEAST_DEPTH_MM**2):
            raise InputError(
                "expected lengths of cables that meet below the motors, got "
                f"{np.ravel(left)[0]:.4g} and {np.ravel(right)[0]:.4g} mm with motors "
                f"{2 * self.half_mm:g} mm apart; home the device again."
            )
        return np.stack([x, -np.sqrt(square)], axis=-1)

    def jacobian(self, place_mm: ArrayLike) -> Floats:
        """A of dl = A dp, (…, 2) to (…, 2, 2); rows: the unit vectors from the motors to the tool.

        Its determinant is 2a·|z|/(l₁l₂): singular at the motors' height.
        """
        place = np.asarray(place_mm, dtype=np.float64)
        motors = np.array([[-self.half_mm, 0.0], [self.half_mm, 0.0]])
        away = place[..., None, :] - motors
        return np.asarray(away / np.linalg.norm(away, axis=-1, keepdims=True))

    # --- Statics ------------------------------------------------------------------------------

    def force_n(self, place_mm: ArrayLike, tensions_n: ArrayLike) -> Floats:
        """Of cables on the tool, −Aᵀ t, (…, 2)."""
        tensions = np.asarray(tensions_n, dtype=np.float64)
        force: Floats = -np.einsum("...ji,...j->...i", self.jacobian(place_mm), tensions)
        return force

    def exact_tensions_n(self, place_mm: ArrayLike, force_n: ArrayLike) -> Floats:
        """The only tensions that give a force, (…, 2); negative where a cable had to push."""
        transposed = np.swapaxes(self.jacobian(place_mm), -1, -2)
        force = np.asarray(force_n, dtype=np.float64)
        return np.asarray(np.linalg.solve(-transposed, force[..., None])[..., 0])

    def cone(self, place_mm: ArrayLike) -> tuple[float, float]:
        """Lowest and highest ratio of Fx to an upward force that cables can pull with at (x, z).

        −(a + x)/|z| and (a − x)/|z|: the directions of the cables themselves.
        """
        x, z = np.asarray(place_mm, dtype=np.float64)
        return -(self.half_mm + x) / -z, (self.half_mm - x) / -z

    def pull(self, place_mm: ArrayLike, force_n: ArrayLike) -> Pull:
        """The tensions for a force at (x, z), within what cables can do.

        A force beyond the largest tension keeps its direction and is made smaller. One outside the
        cone, or with a tension below the least one, gets that cable at its least tension: then its
        direction changes too. Both are marked.
        """
        wanted = self.exact_tensions_n(place_mm, force_n)
        given = wanted.copy()
        largest = float(given.max())
        if largest > self.most_n:
            given *= self.most_n / largest
        given = np.clip(given, self.least_n, self.most_n)
        return Pull(
            tensions_n=given,
            force_n=self.force_n(place_mm, given),
            clipped=bool(np.any(np.abs(given - wanted) > 1e-12 * max(1.0, abs(largest)))),
        )

    def strongest_n(self, place_mm: ArrayLike) -> float:
        """The largest force straight up at (x, z)."""
        unit = self.exact_tensions_n(place_mm, np.array([0.0, 1.0]))
        return float(self.most_n / unit.max())
