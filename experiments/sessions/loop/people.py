"""Who takes part in a session beside the rig: who answers, and who puts the samples in place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from tactileq.experiments.sessions.loop.surfaces import HIGHEST_RATING, Note, Surfaces, Whose
from tactileq.experiments.study.questions import Question
from tactileq.modeling import InputError


class SessionAborted(Exception):
    """Ends the session early; the answers given so far are kept.

    Parameters
    ----------
    reason : str
        As it is stored.
    by : {"participant", "experimenter", "signal", "program"}
        Who ended it.
    """

    def __init__(self, reason: str = "not stated", by: Whose = "participant") -> None:
        super().__init__(reason)
        self.reason = reason
        self.by = by


class ConsentRefused(SessionAborted):
    """Ends a session before it began: the participant did not consent, and is not enrolled."""


@dataclass(frozen=True, kw_only=True)
class Rating:
    """The answer to a trial with two scales: similarity, 0 (different) … 100 (identical).

    Raises
    ------
    InputError
        For a similarity outside 0 … 100.
    """

    magnitude_similarity: float
    frequency_similarity: float
    response_time_s: float

    def __post_init__(self) -> None:
        for name in ("magnitude_similarity", "frequency_similarity"):
            if not 0.0 <= (value := getattr(self, name)) <= HIGHEST_RATING:
                raise InputError(
                    f"expected {name} from 0 to {HIGHEST_RATING:g}, got {value}; rate again."
                )


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The answer to a trial with buttons: the index (from 0) of the chosen button."""

    button: int
    response_time_s: float


class RatedTrial(Protocol):
    """A trial whose answer is the similarity of a real and a virtual surface."""

    @property
    def trial(self) -> int: ...

    @property
    def phase(self) -> str:
        """Either "main", or "training", whose pages are marked."""
        ...

    @property
    def texture(self) -> str: ...

    @property
    def model(self) -> str: ...

    @property
    def virtual_texture(self) -> str:
        """Whose model the virtual surface renders."""
        ...


class ChoiceTrial(Protocol):
    """A trial whose answer is one of several virtual surfaces."""

    @property
    def trial(self) -> int: ...

    @property
    def phase(self) -> str:
        """Either "main", or "training", whose pages are marked."""
        ...

    @property
    def texture(self) -> str: ...

    @property
    def model(self) -> str: ...

    @property
    def layout(self) -> tuple[str, ...]:
        """What is behind each button, from button 1 on: a texture, or a model."""
        ...


@dataclass(frozen=True, kw_only=True)
class Intake:
    """What a participant is asked before the first trial.

    Parameters
    ----------
    consent : str
        Version of the consent form that the participant agreed to; empty where there is none.
    code : str
        The participant's pseudonym.
    known : bool
        Whether this person was here before: then only the code is confirmed.
    """

    consent: str
    code: str
    known: bool
    questions: tuple[Question, ...]


class Respondent(Protocol):
    """Who answers: a person at the console, or a simulated participant."""

    @property
    def simulated(self) -> bool:
        """True unless a person answers."""
        ...

    def hear(self, note: Note, page: Callable[[str], None]) -> None:
        """Receive the log for events outside trials, and the follower of the pages shown."""
        ...

    def consents(self, version: str) -> bool:
        """Whether the participant agrees to this version of the consent form."""
        ...

    def welcome(self, intake: Intake) -> Mapping[str, str | int]:
        """Ask for the code and the study's questions; the answers by question."""
        ...

    def announce(self, page: str, **values: object) -> None:
        """Show a text, by its key, until the participant continues."""
        ...

    def wait(self, until: Callable[[], bool]) -> None:
        """Ask the participant to wait until the experimenter is ready."""
        ...

    def rest(self) -> None:
        """A break, which the participant ends."""
        ...

    def progress(self, done: int, of: int) -> None:
        """Show from now on how many trials are done."""
        ...

    def rate(self, trial: RatedTrial, surfaces: Surfaces) -> Rating:
        """Compare the real with the virtual surface and rate their likeness."""
        ...

    def choose(self, trial: ChoiceTrial, surfaces: Surfaces) -> Choice:
        """Choose one of the virtual surfaces."""
        ...


@dataclass(frozen=True, kw_only=True)
class ProgressReport:
    """The progress of a session, as an experimenter sees it.

    Parameters
    ----------
    done, of : int
        Main trials.
    minutes_left : float, optional
        An estimate from the trials so far; None before the first.
    problems : tuple of str
        Of the rig, one sentence each.
    """

    phase: str
    done: int
    of: int
    minutes_left: float | None
    problems: tuple[str, ...]


class Experimenter(Protocol):
    """Who mounts samples and is called when something fails; sees no names of conditions."""

    def ask_mount(self, tray: str) -> None:
        """Ask for the sample of a tray."""
        ...

    def call(self, sentence: str) -> None:
        """Report what failed, and ask to repair it."""
        ...

    def go_on(self) -> None:
        """Ask for nothing: ready at once, unless the session is to be stopped."""
        ...

    def ready(self) -> bool:
        """Whether what was asked last has been confirmed; SessionAborted where it is to end."""
        ...

    def report(self, progress: ProgressReport) -> None:
        """Show the progress of the session and the state of the rig."""
        ...

    def page(self, name: str) -> None:
        """Show which page the participant is on."""
        ...

    def answered(self) -> None:
        """Show that an answer was given, but not which one."""
        ...
