"""What an experiment sees of a rig, be it metal or simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from modeling.models.loading import Layered


@dataclass(frozen=True)
class RigReading:
    """One reading of the hand.

    Parameters
    ----------
    time_s : float
        Since the rig was opened.
    speed_mm_s : float
        Tangential speed without its direction, ≥ 0. A rig renders from the speed with its sign
        (docs/method/rendering.md#extrapolation).
    force_n : float
        Normal force, ≥ 0; 0 off the surface.
    button : bool
        Whether the button was pressed since the last reading.
    simulated : bool
    """

    time_s: float
    speed_mm_s: float
    force_n: float
    button: bool
    simulated: bool


class TextureRig(Protocol):
    """A device that puts surfaces under a hand, one at a time."""

    @property
    def simulated(self) -> bool:
        """Whether no real hand touches a real surface here."""

    def present_model(self, model: Layered) -> None:
        """Render this model wherever the virtual surface is touched, from now on."""

    def present_real(self, texture: str) -> None:
        """Give way to the mounted real surface, whose texture is named."""

    def silence(self) -> None:
        """Present nothing: no vibration and no virtual surface."""

    def read(self) -> RigReading:
        """The hand as it is now."""
