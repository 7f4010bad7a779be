"""The one loop of both protocols: mount the sample, present, ask, store, fall silent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from experiments.sessions.store import SessionStore
from experiments.study.design import AbsoluteTrial, Phase, RelativeTrial, SessionPlan, Trial
from modeling import InputError, TextureModel
from rig.interface import TextureRig

HIGHEST_RATING = 100.0


class SessionAborted(Exception):
    """Raised by a respondent to end the session early; the answers given so far are kept."""


@dataclass(frozen=True, kw_only=True)
class Rating:
    """The answer to an absolute trial: two similarities, 0 (nothing alike) … 100 (identical).

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
    """The answer to a relative trial: the index (from 0) of the chosen button."""

    button: int
    response_time_s: float


class Surfaces:
    """What a participant can switch between in one trial; made by the trial loop.

    Parameters
    ----------
    rig : TextureRig
    texture : str
        The real surface.
    models : sequence of TextureModel
        The virtual surfaces, one per button.

    Attributes
    ----------
    switches : int
        Changes between the real and a virtual surface, the first presentation not counted.
    presses : int
        Presentations of a virtual surface, repeated ones included.
    """

    def __init__(self, rig: TextureRig, *, texture: str, models: Sequence[TextureModel]) -> None:
        self._rig = rig
        self._texture = texture
        self._models = tuple(models)
        self._shown: str | None = None
        self._selected: int | None = None
        self.switches = 0
        self.presses = 0
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

    def present_real(self) -> None:
        """Present the real surface (the virtual one is switched off)."""
        self._rig.present_real(self._texture)
        self._note("real")

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
        self._rig.present_model(self._models[index])
        self._selected = index
        self.presses += 1
        self._note("virtual")

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

    def _note(self, shown: str) -> None:
        if self._shown is not None and self._shown != shown:
            self.switches += 1
        self._shown = shown


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

    def rate(self, trial: AbsoluteTrial, surfaces: Surfaces) -> Rating:
        """Compare the real with the virtual surface and rate their likeness."""
        ...

    def choose(self, trial: RelativeTrial, surfaces: Surfaces) -> Choice:
        """Say which virtual surface is the real one."""
        ...


@dataclass(frozen=True, kw_only=True)
class SessionResult:
    """How a session ended: `answered` of `planned` trials are in the file at `path`."""

    path: Path
    planned: int
    answered: int

    @property
    def completed(self) -> bool:
        """Whether every planned trial was answered."""
        return self.answered == self.planned


@dataclass(frozen=True, kw_only=True)
class Script:
    """What distinguishes the two protocols.

    Parameters
    ----------
    announcements : mapping of phase to (title, text)
        What the participant reads before the phase.
    closing : (title, text)
        What the participant reads at the end.
    virtual : callable
        The virtual surfaces of a trial, one per button.
    begin : callable
        Presents the first surface of a trial.
    ask : callable
        Asks the respondent; the columns that are answers.
    """

    announcements: Mapping[Phase, tuple[str, str]]
    closing: tuple[str, str]
    virtual: Callable[[Any], Sequence[TextureModel]]
    begin: Callable[[Any, Surfaces], None]
    ask: Callable[[Any, Surfaces], Mapping[str, object]]


def run_session(
    plan: SessionPlan,
    script: Script,
    *,
    columns: Mapping[str, Mapping[str, Any]],
    description: str,
    rig: TextureRig,
    respondent: Respondent,
    data_folder: str | Path,
) -> SessionResult:
    """Store the plan of a session, then run its trials.

    Parameters
    ----------
    plan : SessionPlan
    script : Script
        The protocol.
    columns : mapping of column to its description
        Of the file of answers.
    description : str
        Of the task.
    rig, respondent
        What presents, and who answers.
    data_folder : path
        Root of the data set.

    Raises
    ------
    InputError
        If the session has been run before.
    StoreError
        If the disk does not take the answers.
    """
    with SessionStore.create(
        data_folder,
        plan=plan,
        columns=columns,
        description=description,
        simulated_participant=respondent.simulated,
        simulated_rig=rig.simulated,
    ) as store:
        return run_trials(plan.trials, script, rig=rig, respondent=respondent, store=store)


def run_trials(
    trials: Sequence[Trial],
    script: Script,
    *,
    rig: TextureRig,
    respondent: Respondent,
    store: SessionStore,
) -> SessionResult:
    """Run all trials of a session; the rig is silent afterwards, whatever happens.

    Parameters
    ----------
    trials : sequence
        In the order of the session's plan.
    script : Script
        The protocol.
    rig, respondent, store
        What presents, who answers, where the answers go.

    Returns
    -------
    SessionResult
        Also after an abort by the respondent; any other exception is logged and passed on.
    """
    answered = 0
    try:
        rig.silence()
        store.log("session started", f"{len(trials)} trials planned")
        for trial in _announced(trials, script, respondent=respondent, store=store):
            row = _run_trial(trial, script, rig=rig, respondent=respondent, store=store)
            store.append(row)
            answered += 1
            rig.silence()
        store.log("session ended", f"{answered} trials answered")
        # Everything is answered: leaving the last page with Escape is not an abort.
        with suppress(SessionAborted):
            respondent.announce(*script.closing)
    except SessionAborted:
        store.log("session aborted", f"{answered} trials answered")
    except BaseException as error:
        # The log must not hide what went wrong, for instance when the disk is full.
        with suppress(OSError):
            store.log("session broken off", f"{type(error).__name__}: {error}")
        raise
    finally:
        rig.silence()
    return SessionResult(path=store.path, planned=len(trials), answered=answered)


def _announced(
    trials: Sequence[Trial],
    script: Script,
    *,
    respondent: Respondent,
    store: SessionStore,
) -> Iterable[Trial]:
    """The trials, each phase announced before its first one."""
    phase = None
    for trial in trials:
        if trial.phase != phase:
            phase = trial.phase
            respondent.announce(*script.announcements[phase])
            store.log("phase started", phase)
        yield trial


def _run_trial(
    trial: Trial,
    script: Script,
    *,
    rig: TextureRig,
    respondent: Respondent,
    store: SessionStore,
) -> dict[str, object]:
    label = f"trial {trial.trial}, tray {trial.tray}"
    store.log("mount requested", label)
    respondent.confirm_mount(trial.tray)
    store.log("mount confirmed", label)
    surfaces = Surfaces(rig, texture=trial.texture, models=script.virtual(trial))
    script.begin(trial, surfaces)
    answer = script.ask(trial, surfaces)
    return {
        "trial": trial.trial,
        "phase": trial.phase,
        "texture": trial.texture,
        "model": trial.model,
        "tray": trial.tray,
        **answer,
        "simulated": respondent.simulated or rig.simulated,
    }
