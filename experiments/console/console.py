"""The console: what the participant sees and presses (PsychoPy).

The screen shows numbers and questions, never a tray, a texture or a model. PsychoPy is imported
when a console opens: it takes seconds and needs a display.
"""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType

from tactileq.experiments.console import intake_pages, trial_pages
from tactileq.experiments.console.languages import Texts
from tactileq.experiments.console.page_runner import PageHook, PageRunner
from tactileq.experiments.console.screens import open_window
from tactileq.experiments.sessions.loop.people import (
    Choice,
    ChoiceTrial,
    Intake,
    RatedTrial,
    Rating,
)
from tactileq.experiments.sessions.loop.surfaces import Note, Surfaces
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.study import TASKS
from tactileq.experiments.tasks import task_named


class Console:
    """A respondent: the person at the screen.

    Every page can be worked by the mouse alone and by keys alone, and left by Escape or its stop
    button, which ask again and for a reason (docs/method/protocols.md#console).

    Parameters
    ----------
    texts : Texts, optional
        What the pages say; by default in English.
    stamp : str
        What every page is marked with, such as "pilot, simulated rig"; empty for none.
    size : (int, int)
        Window in pixels, at least 4:3.
    screen : int
        Which screen, from 0.
    on_page : callable, optional
        Called with each page that is shown; lets a test press the right pixels.

    Raises
    ------
    InputError
        For a screen that is not there.
    """

    simulated = False

    def __init__(
        self,
        *,
        texts: Texts | None = None,
        stamp: str = "",
        size: tuple[int, int] = (1280, 800),
        fullscreen: bool = False,
        screen: int = 0,
        on_page: PageHook | None = None,
    ) -> None:
        texts = texts or Texts.load("en")
        self._window = open_window(size=size, fullscreen=fullscreen, screen=screen)
        self._runner = PageRunner(self._window, texts, stamp=texts.stamp(stamp), on_page=on_page)

    def close(self) -> None:
        """Close the window."""
        self._window.close()

    def __enter__(self) -> Console:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    # --- The respondent: each page may raise SessionAborted -----------------------------------

    def hear(self, note: Note, page: Callable[[str], None]) -> None:
        """Receive the log for events, such as a request to stop, and the follower of pages."""
        self._runner.note, self._runner.follow = note, page

    def consents(self, version: str) -> bool:
        """Whether the participant agrees to this version of the consent form."""
        return intake_pages.consents(self._runner, version)

    def welcome(self, intake: Intake) -> dict[str, str | int]:
        """Code and questions; the answers by question."""
        return intake_pages.welcome(self._runner, intake)

    def announce(self, page: str, **values: object) -> None:
        """Show the page of this key until the participant continues."""
        intake_pages.message(self._runner, page, values=values)

    def wait(self, until: Callable[[], bool]) -> None:
        """Ask the participant to wait until the experimenter is ready."""
        of, runner = self._runner.texts.of, self._runner
        runner.show(
            "wait",
            widgets=(),
            decoration=(
                runner.title(of("wait.title"), y=0.12),
                runner.body(of("wait.text"), y=0.0),
            ),
            until=until,
        )

    def rest(self) -> None:
        """A break, which the participant ends."""
        self.announce("rest")

    def progress(self, done: int, of: int) -> None:
        """Show from now on how many trials are done."""
        self._runner.progress = (done, of)

    def rate(self, trial: RatedTrial, surfaces: Surfaces) -> Rating:
        """Compare the real with the virtual surface and rate their likeness."""
        return trial_pages.rate(self._runner, trial, surfaces)

    def choose(self, trial: ChoiceTrial, surfaces: Surfaces) -> Choice:
        """Choose one of the virtual surfaces."""
        return trial_pages.choose(self._runner, trial, surfaces, task=_task_of(trial))


def _task_of(trial: object) -> Task:
    """The task whose trial this is."""
    tasks = (task_named(name) for name in TASKS)
    return next(task for task in tasks if isinstance(trial, task.trial))
