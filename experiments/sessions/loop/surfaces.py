"""What a participant feels in a trial, who answers, who mounts samples, and what an answer is."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Literal, Protocol

from tactileq.modeling import InputError
from tactileq.rig.shared.interface import Presentable, Stimulus, TextureRig, ToneBurst

HIGHEST_RATING = 100.0
Whose = Literal["participant", "experimenter", "signal", "program"]


class Note(Protocol):
    """Writes an event into the log of the session."""

    def __call__(self, event: str, **fields: object) -> None: ...


def present(rig: TextureRig, shown: Presentable | ToneBurst) -> float:
    """Present a virtual surface, a stimulus from its beginning; when its first sample left."""
    if isinstance(shown, ToneBurst | Stimulus):
        return rig.present_signal(shown)
    return rig.present_model(shown)


class Surfaces:
    """What a participant can switch between in one trial; made by the trial loop.

    Parameters
    ----------
    texture : str
        The real surface.
    models : sequence of TextureModel, RegressedModel, ARModel, Stimulus or ToneBurst
        The virtual surfaces, one per button; a stimulus plays once each time that it is presented,
        a burst once in a trial.
    begin : callable
        Presents the first surface; called by `start`.
    note : callable
        Writes an event into the session's log.
    feel_all : bool
        Whether every virtual surface must be felt before an answer.

    Attributes
    ----------
    feel_all : bool
    started : bool
        Whether the first surface has been presented.
    switches : int
        Changes between the real and a virtual surface, the first presentation not counted.
    presses : int
        Presentations of a virtual surface, repeated ones included.
    felt : set of int
        Indices of the virtual surfaces that have been presented.
    first_sample_s : float or None
        When the first sample of the first presentation left, on the rig's clock.
    """

    def __init__(
        self,
        rig: TextureRig,
        *,
        texture: str,
        models: Sequence[Presentable | ToneBurst],
        begin: Callable[[Surfaces], None],
        note: Note,
        feel_all: bool = False,
    ) -> None:
        self._rig = rig
        self._texture = texture
        self._models = tuple(models)
        self._begin = begin
        self._note = note
        self._shown: str | None = None
        self._last: int | None = None
        self._last_left_s = 0.0
        self._cut_off = False
        self._chosen: int | None = None
        self.feel_all = feel_all
        self.started = False
        self.switches = 0
        self.presses = 0
        self.felt: set[int] = set()
        self.first_sample_s: float | None = None
        self._began_s: float | None = None
        rig.read()  # a press of the rig's button before the trial is not one in it

    @property
    def shows_real(self) -> bool:
        """Whether the real surface is presented now."""
        return self._shown == "real"

    @property
    def last(self) -> int | None:
        """Index of the virtual surface presented last, None before the first."""
        return self._last

    @property
    def chosen(self) -> int | None:
        """Index of the virtual surface chosen so far, None before a choice."""
        return self._chosen

    @property
    def count(self) -> int:
        """Number of virtual surfaces."""
        return len(self._models)

    @property
    def bursts(self) -> bool:
        """Whether bursts stand for surfaces: nothing is presented before a button is pressed."""
        return any(isinstance(shown, ToneBurst) for shown in self._models)

    @property
    def response_time_s(self) -> float:
        """Time since the first sample of the first presentation left; 0 before."""
        return 0.0 if self._began_s is None else time.perf_counter() - self._began_s

    def note(self, event: str, **fields: object) -> None:
        """Write an event of this trial into the session's log, as the end of a slider's move."""
        self._note(event, **fields)

    def start(self) -> None:
        """Present the first surface; a respondent calls it when it announces the trial."""
        if not self.started:
            self.started = True
            self._begin(self)

    def present_real(self) -> None:
        """Present the real surface (the virtual one is switched off)."""
        self._presented("real", self._rig.present_real(self._texture))

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
        shown = self._models[index]
        if isinstance(shown, ToneBurst) and index in self.felt:
            return
        self._last = index
        self._last_left_s = present(self._rig, shown)
        self.presses += 1
        self.felt.add(index)
        self._presented("virtual", self._last_left_s, index=index)

    def choose(self, index: int) -> None:
        """Choose a virtual surface that was felt (index from 0); the last choice counts.

        An act of its own: what was felt last is no choice.

        Raises
        ------
        InputError
            If it was not felt yet.
        """
        if index not in self.felt:
            raise InputError(
                f"expected a choice of a surface that was felt, got {index}; press it first."
            )
        self._chosen = index
        self._note("chosen", index=index)

    def toggle(self) -> None:
        """Change between the real surface and the virtual one presented last, if any."""
        if not self.shows_real:
            self.present_real()
        elif self._last is not None:
            self.present_virtual(self._last)
        elif len(self._models) == 1:
            self.present_virtual()

    def pause(self) -> None:
        """Present nothing for a while, as long as the participant is asked something else."""
        last = None if self._last is None else self._models[self._last]
        if isinstance(last, ToneBurst):
            self._cut_off = self._rig.now_s() < self._last_left_s + last.duration_s
        self._rig.silence()

    def resume(self) -> None:
        """Present again what was presented before the pause; of bursts only one that it cut off."""
        self._rig.read()  # a press of the rig's button meanwhile is not one in the trial
        if self.shows_real:
            self._again("real", self._rig.present_real(self._texture))
        elif self._last is not None:
            shown = self._models[self._last]
            if self._cut_off or not isinstance(shown, ToneBurst):
                self._last_left_s = present(self._rig, shown)
                self._again("virtual", self._last_left_s, index=self._last)

    def follow_rig_button(self) -> None:
        """Toggle if the rig's button has been pressed since the last call."""
        if self._rig.read().button:
            self.toggle()

    def _again(self, shown: str, left_s: float, **which: int) -> None:
        self._note("presented", surface=shown, start_s=left_s, **which)

    def _presented(self, shown: str, left_s: float, **which: int) -> None:
        if self.first_sample_s is None:
            # The rig's clock may be its own, as a twin's is: only how long ago it was counts.
            self.first_sample_s = left_s
            self._began_s = time.perf_counter() - (self._rig.now_s() - left_s)
        if self._shown is not None and self._shown != shown:
            self.switches += 1
        self._shown = shown
        self._again(shown, left_s, **which)
