"""A rig as the window for visitors sees it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from tactileq.modeling.models.loading import Layered


@dataclass(frozen=True, kw_only=True)
class HandNow:
    """The hand as last read.

    Parameters
    ----------
    speed_mm_s : float
        Tangential speed; its sign is the direction.
    there : bool
        Whether a reading came within the last 100 ms; else the rig counts the hand as lifted off.
    force_assumed : bool
        Whether nothing measures the force.
    depth_mm : float
        Below the wall of a force device; NaN without one. The force is then commanded.
    """

    speed_mm_s: float
    force_n: float
    there: bool = True
    force_assumed: bool = False
    depth_mm: float = float("nan")


NO_HAND = HandNow(speed_mm_s=0.0, force_n=0.0, there=False)


@dataclass(frozen=True, kw_only=True)
class OutputNow:
    """The output to the hand.

    Parameters
    ----------
    rms_g, peak_g : float
        Of what left in about the last quarter of a second.
    limits : tuple of str
        The limits that it touched since it was last asked ("peak", "RMS", "duration").
    misses : int
        Blocks that came too late since the sound was opened.
    latency_s : float
        As the sound output states it; NaN where unknown.
    """

    rms_g: float
    peak_g: float
    limits: tuple[str, ...] = ()
    misses: int = 0
    latency_s: float = float("nan")


class FeltRig(Protocol):
    """A rig whose hand and output can be looked at while it plays."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What of it is simulated, assumed or missing, a phrase each."""

    def present_model(self, model: Layered) -> object:
        """Render this model under the hand, from now on."""

    def arm(self) -> None:
        """Let a force device push from now on, also after a fault; nothing of a rig without one."""

    def silence(self) -> object:
        """Render nothing."""

    def mask(self, on: bool) -> None:
        """Play masking noise to the ears, or stop it."""

    def point(self, x: float, y: float, *, inside: bool) -> None:
        """Where the window's pointer is (pixels), for a rig to which it is the hand."""

    def hand(self) -> HandNow:
        """The hand as it is now; never waits."""

    def output(self) -> OutputNow | None:
        """The present output, None if there is none; never waits."""

    @property
    def halted(self) -> bool:
        """Whether what was presented last was halted, as a rig does that nobody looks after."""

    def take_faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each.

        To be called ten times a second while something is presented; an exception where nothing
        can be played any more.
        """
