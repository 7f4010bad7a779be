"""What a participant feels in a trial, who answers, and what an answer is."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from experiments.study.design import Trial
from modeling import InputError
from modeling.models.loading import AnyModel
from rig.interface import TextureRig

HIGHEST_RATING = 100.0


class SessionAborted(Exception):
    """Raised by a respondent to end the session early; the answers given so far are kept."""


@dataclass(frozen=True, kw_only=True)
class Rating:
    """The answer to a trial with two scales: similarities, 0 (nothing alike) … 100 (identical).

    Raises
    ------
    InputError
        For a similarity outside 0 … 100.
    """

    magnitude_similarity: float
    frequency_similarity: float
    response_time_s: float

    def __post_init__(self) -> None:
        for value in (self.magnitude_similarity, self.frequency_similarity):
            if not 0.0 <= value <= HIGHEST_RATING:
                raise InputError(
                    f"expected a similarity from 0 to {HIGHEST_RATING:g}, got {value}; rate again."
                )


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The answer to a trial with buttons: the index (from 0) of the chosen button."""

    button: int
    response_time_s: float


class Surfaces:
    """What a participant can switch between in one trial; made by the trial loop.

    Parameters
    ----------
    rig : TextureRig
    texture : str
        The real surface.
    models : sequence of models of any kind
        The virtual surfaces, one per button.

    Attributes
    ----------
    switches : int
        Changes between the real and a virtual surface, the first presentation not counted.
    presses : int
        Presentations of a virtual surface, repeated ones included.
    first_sample_s : float or None
        When the first sample of the first presentation left, on the rig's clock.
    """

    def __init__(self, rig: TextureRig, *, texture: str, models: Sequence[AnyModel]) -> None:
        self._rig = rig
        self._texture = texture
        self._models = tuple(models)
        self._shown: str | None = None
        self._selected: int | None = None
        self.switches = 0
        self.presses = 0
        self.first_sample_s: float | None = None
        self._began_s: float | None = None
        rig.read()  # a press of the rig's button before the trial is not one in it

    @property
    def shows_real(self) -> bool:
        """Whether the real surface is presented now."""
        return self._shown == "real"

    @property
    def selected(self) -> int | None:
        """Index of the virtual surface presented last, None before the first."""
        return self._selected

    @property
    def count(self) -> int:
        """Number of virtual surfaces."""
        return len(self._models)

    @property
    def response_time_s(self) -> float:
        """Time since the first sample of the first presentation left; 0 before."""
        return 0.0 if self._began_s is None else time.perf_counter() - self._began_s

    def present_real(self) -> None:
        """Present the real surface (the virtual one is switched off)."""
        self._note("real", self._rig.present_real(self._texture))

    def present_virtual(self, index: int = 0) -> None:
        """Present the virtual surface of a button (index from 0).

        Raises
        ------
        InputError
            If there is no such button.
        """
        if not 0 <= index < len(self._models):
            raise InputError(
                f"expected a button from 0 to {len(self._models) - 1}, got {index}; press another."
            )
        left_s = self._rig.present_model(self._models[index])
        self._selected = index
        self.presses += 1
        self._note("virtual", left_s)

    def toggle(self) -> None:
        """Change between the real surface and the virtual one presented last, if any."""
        if not self.shows_real:
            self.present_real()
        elif self._selected is not None:
            self.present_virtual(self._selected)
        elif len(self._models) == 1:
            self.present_virtual()

    def follow_rig_button(self) -> None:
        """Toggle if the rig's button has been pressed since the last call."""
        if self._rig.read().button:
            self.toggle()

    def _note(self, shown: str, left_s: float) -> None:
        if self.first_sample_s is None:
            # The rig's clock may be its own, as a twin's is: only how long ago it was counts.
            self.first_sample_s = left_s
            self._began_s = time.perf_counter() - (self._rig.now_s() - left_s)
        if self._shown is not None and self._shown != shown:
            self.switches += 1
        self._shown = shown


class ChoiceTrial(Protocol):
    """A trial whose answer is one of several virtual surfaces."""

    @property
    def texture(self) -> str: ...

    @property
    def model(self) -> str: ...

    @property
    def layout(self) -> tuple[str, ...]:
        """Texture behind each button, from button 1 on."""
        ...


class Respondent(Protocol):
    """Who answers: a person at the console, or a simulated participant."""

    @property
    def simulated(self) -> bool:
        """True unless a person answers."""
        ...

    def announce(self, title: str, text: str) -> None:
        """Show a message until the participant goes on."""
        ...

    def confirm_mount(self, tray: str) -> None:
        """Return once the sample of this tray is in place."""
        ...

    def rate(self, trial: Trial, surfaces: Surfaces) -> Rating:
        """Compare the real with the virtual surface and rate their likeness."""
        ...

    def choose(self, trial: ChoiceTrial, surfaces: Surfaces) -> Choice:
        """Say which virtual surface is the real one."""
        ...
