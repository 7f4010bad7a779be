"""A virtual wall, and the stiffness up to which a sampled one is passive."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from tactileq.modeling.checks import check_number

STIFFEST_N_PER_MM = 20.0
LARGEST_MM = 1000.0
# In nominal periods, as in force.h: above the first one on average a servo lets go; walls are to be
# passive for the second one, since long periods may come when the tool is fastest.
SLOW_FROM, SLOWEST = 1.5, 2


@dataclass(frozen=True, kw_only=True)
class Wall:
    """A spring-damper surface in the frame of a device's pose: a rectangle, felt from above.

    Parameters
    ----------
    height_mm : float
        Along the frame's z, −1000 … 1000.
    stiffness_n_per_mm : float
        Above 0 … 20.
    damping_n_s_per_m : float
        Of the virtual damper, 0 … 100.
    width_mm, length_mm : float
        Along the frame's x and y, about its origin; above 0 … 1000.

    Raises
    ------
    InputError
    """

    height_mm: float = 0.0
    stiffness_n_per_mm: float
    damping_n_s_per_m: float = 0.0
    width_mm: float = 200.0
    length_mm: float = 200.0

    def __post_init__(self) -> None:
        check_number("height_mm", self.height_mm, low=-LARGEST_MM, high=LARGEST_MM)
        check_number(
            "stiffness_n_per_mm", self.stiffness_n_per_mm, low=1e-6, high=STIFFEST_N_PER_MM
        )
        check_number("damping_n_s_per_m", self.damping_n_s_per_m, low=0.0, high=100.0)
        for name in ("width_mm", "length_mm"):
            check_number(name, getattr(self, name), low=1e-3, high=LARGEST_MM)


def largest_stiffness_n_per_mm(
    *, rate_hz: float, damping_n_s_per_m: float, delay_s: float, wall_damping_n_s_per_m: float = 0.0
) -> float:
    """Up to which stiffness a sampled wall cannot generate energy.

    Parameters
    ----------
    rate_hz : float
        Ticks in a second, above 0.
    damping_n_s_per_m : float
        Of the device itself (viscous), ≥ 0; what the hand adds is not counted.
    delay_s : float
        From a reading to the force that answers it, the sampling's half period not counted, ≥ 0.
    wall_damping_n_s_per_m : float
        Of the virtual damper.

    Returns
    -------
    float
        N/mm; 0 or less where no wall with this damper is passive.

    Notes
    -----
    b > K T/2 + |B| is necessary and sufficient without delay (J. E. Colgate and G. Schenkel,
    Passivity of a class of sampled-data systems: application to haptic interfaces, 1997). With a
    delay of whole periods the same condition,
    b > T/2 / (1 − cos ωT) · Re{(1 − e^(−jωT)) H(e^(jωT))} at all ω, holds for
    K (T/2 + t_d) + |B|, which is sufficient and, for B = 0, necessary: the term of K is largest at
    ω = 0, that of B is at most |B| (docs/force-device.md#stiffness).
    """
    left = damping_n_s_per_m - abs(wall_damping_n_s_per_m)
    return 1e-3 * left / (0.5 / rate_hz + delay_s) if rate_hz < inf else inf
