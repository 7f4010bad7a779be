"""The console: what the experimenter and the participant see and press (PsychoPy).

The screen names trays and numbers, never a texture or a model. PsychoPy is imported when a
console opens: it takes seconds and needs a display.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any

from experiments.console.screens import open_window
from experiments.console.widgets import (
    BLUE,
    CARD,
    GREY,
    ORANGE,
    PALE,
    SMALL_HEIGHT,
    TITLE_HEIGHT,
    Button,
    Mouse,
    Page,
    RatingScale,
    rounded,
    text,
)
from experiments.sessions.surfaces import Choice, ChoiceTrial, Rating, SessionAborted, Surfaces
from experiments.study.design import Trial

# --- Parameters -----------------------------------------------------------------------------

SCALE_ENDS = ("completely different", "identical")
MOUNT_NOTE = "For the experimenter: the rig is silent now.\nConfirm once the sample sits firmly."
MAGNITUDE_LABEL = "Vibration magnitude"
FREQUENCY_LABEL = "Frequency pattern"
FRAME_PAUSE_S = 0.004  # keeps a display without vertical synchronisation from spinning
BUTTONS_PER_ROW = 7
BUTTON_PITCH = 0.15

# Called when a page comes up: its name, and the window's pixel (from the top left) of each handle.
PageHook = Callable[[str, Mapping[str, tuple[int, int]]], None]


class Console:
    """A respondent: the person at the screen.

    Parameters
    ----------
    size : (int, int)
        Window in pixels, at least 4:3.
    fullscreen : bool
    screen : int
        Which screen, from 0; InputError where there is none.
    on_page : callable, optional
        Told of each page that comes up; lets a test press the right pixels.
    """

    simulated = False

    def __init__(
        self,
        *,
        size: tuple[int, int] = (1280, 800),
        fullscreen: bool = False,
        screen: int = 0,
        on_page: PageHook | None = None,
    ) -> None:
        self._window = open_window(size=size, fullscreen=fullscreen, screen=screen)
        self._mouse = Mouse(self._window)
        self._on_page = on_page
        self._done = False

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

    # --- The respondent ---------------------------------------------------------------------

    def announce(self, title: str, text: str) -> None:
        """Show a message and go on at a press of a button.

        Raises
        ------
        SessionAborted
            At Escape.
        """
        self._message("message", title=title, body=text, label="Continue")

    def confirm_mount(self, tray: str) -> None:
        """Ask the experimenter for the sample of a tray; go on once it is confirmed.

        Raises
        ------
        SessionAborted
            At Escape.
        """
        self._message(
            "mount",
            title=f"Put the sample from tray {tray} in place",
            body=MOUNT_NOTE,
            label="Sample is in place",
        )

    def rate(self, trial: Trial, surfaces: Surfaces) -> Rating:
        """Two rating scales, and a toggle between the real and the virtual surface.

        Raises
        ------
        SessionAborted
            At Escape.
        """
        magnitude = self._scale("magnitude", MAGNITUDE_LABEL, y=0.06)
        frequency = self._scale("frequency", FREQUENCY_LABEL, y=-0.165)
        real = self._button(
            "real", "Real surface", at=(-0.17, 0.29), action=surfaces.present_real, color=ORANGE
        )
        virtual = self._button(
            "virtual", "Virtual surface", at=(0.17, 0.29), action=surfaces.present_virtual
        )
        proceed = self._button("continue", "Continue", at=(0.0, -0.38), action=self._finish)

        def update() -> None:
            real.lit, virtual.lit = surfaces.shows_real, not surfaces.shows_real
            compared = surfaces.switches > 0
            proceed.enabled = compared and magnitude.rated and frequency.rated

        page = Page(
            "rate",
            widgets=(real, virtual, magnitude, frequency, proceed),
            decoration=(
                self._title("How alike are the two surfaces?"),
                self._note("Feel both; the filled button is the one that you feel now.", y=0.212),
                *self._cards((0.072, 0.2), (-0.153, 0.2)),
            ),
        )
        self._show(page, surfaces=surfaces, update=update)
        return Rating(
            magnitude_similarity=magnitude.rating,
            frequency_similarity=frequency.rating,
            response_time_s=surfaces.response_time_s,
        )

    def choose(self, trial: ChoiceTrial, surfaces: Surfaces) -> Choice:
        """One numbered button per virtual surface, one for the real surface, one to confirm.

        Raises
        ------
        SessionAborted
            At Escape.
        """
        real = self._button(
            "real", "Real surface", at=(0.0, 0.3), action=surfaces.present_real, color=ORANGE
        )
        rows = -(-surfaces.count // BUTTONS_PER_ROW)
        numbered = [self._numbered(index, surfaces, rows=rows) for index in range(surfaces.count)]
        confirm = self._button("confirm", "This one", at=(0.0, -0.36), action=self._finish)
        picked = self._note("", y=-0.265)

        def update() -> None:
            real.lit = surfaces.shows_real
            for index, button in enumerate(numbered):
                button.lit = surfaces.selected == index and not surfaces.shows_real
            confirm.enabled = surfaces.selected is not None
            told = "Press a number to feel a virtual surface."
            if surfaces.selected is not None:
                told = f"Your choice so far: {surfaces.selected + 1}"
            if picked.text != told:
                picked.text = told

        page = Page(
            "choose",
            widgets=(real, *numbered, confirm),
            decoration=(
                self._title("Which virtual surface matches the real one?"),
                self._note("The filled button is the surface that you feel now.", y=0.225),
                *self._cards((0.0, 0.06 + BUTTON_PITCH * rows)),
                picked,
            ),
        )
        self._show(page, surfaces=surfaces, update=update)
        assert surfaces.selected is not None
        return Choice(button=surfaces.selected, response_time_s=surfaces.response_time_s)

    # --- Parts of the pages -----------------------------------------------------------------

    def _message(self, name: str, *, title: str, body: str, label: str) -> None:
        page = Page(
            name,
            widgets=(self._button("confirm", label, at=(0.0, -0.2), action=self._finish),),
            decoration=(
                text(self._window, title, at=(0.0, 0.14), height=TITLE_HEIGHT, bold=True),
                text(self._window, body, at=(0.0, 0.01), color=GREY, wrap=0.9),
            ),
        )
        self._show(page)

    def _title(self, content: str) -> Any:
        return text(self._window, content, at=(0.0, 0.41), height=TITLE_HEIGHT, bold=True)

    def _note(self, content: str, *, y: float) -> Any:
        return text(self._window, content, at=(0.0, y), height=SMALL_HEIGHT, color=GREY)

    def _scale(self, name: str, label: str, *, y: float) -> RatingScale:
        return RatingScale(
            self._window, name, label=label, ends=SCALE_ENDS, at=(0.0, y), width=0.95
        )

    def _button(
        self,
        name: str,
        label: str,
        *,
        at: tuple[float, float],
        action: Callable[[], None],
        color: str = BLUE,
    ) -> Button:
        return Button(
            self._window, name, label=label, at=at, size=(0.31, 0.078), action=action, color=color
        )

    def _numbered(self, index: int, surfaces: Surfaces, *, rows: int) -> Button:
        row, column = divmod(index, BUTTONS_PER_ROW)
        in_row = min(BUTTONS_PER_ROW, surfaces.count - row * BUTTONS_PER_ROW)
        at = (
            BUTTON_PITCH * (column - (in_row - 1) / 2),
            BUTTON_PITCH * ((rows - 1) / 2 - row),
        )
        return Button(
            self._window,
            f"button {index + 1}",
            label=str(index + 1),
            at=at,
            size=(0.12, 0.12),
            action=lambda: surfaces.present_virtual(index),
        )

    def _cards(self, *middles_and_heights: tuple[float, float]) -> list[Any]:
        from psychopy import visual

        return [
            visual.ShapeStim(
                self._window,
                vertices=rounded((1.16, height), 0.02),
                pos=(0.0, y),
                fillColor=CARD,
                lineColor=PALE,
                lineWidth=1,
                units="height",
                autoLog=False,
            )
            for y, height in middles_and_heights
        ]

    # --- Showing a page ---------------------------------------------------------------------

    def _finish(self) -> None:
        self._done = True

    def _show(
        self,
        page: Page,
        *,
        surfaces: Surfaces | None = None,
        update: Callable[[], None] = lambda: None,
    ) -> None:
        """Run a page until it is finished."""
        from psychopy import event

        self._done = False
        event.clearEvents()
        self._mouse.take()  # presses meant for the page before
        first = True
        while not self._done:
            update()
            page.draw()
            if first and self._on_page is not None:
                self._on_page(page.name, self._pixels(page))
            first = False
            self._window.flip()
            if "escape" in event.getKeys(["escape"]):
                raise SessionAborted
            self._respond(page, surfaces, update=update)
            time.sleep(FRAME_PAUSE_S)

    def _respond(
        self, page: Page, surfaces: Surfaces | None, *, update: Callable[[], None]
    ) -> None:
        if surfaces is not None:
            surfaces.follow_rig_button()
        for kind, point in self._mouse.take():
            page.handle(kind, point)
            update()  # the next event may be for a button that this one has enabled
            if self._done:
                return

    def _pixels(self, page: Page) -> dict[str, tuple[int, int]]:
        width, height = self._window.winHandle.get_size()
        return {
            name: (round(width / 2 + x * height), round(height / 2 - y * height))
            for name, (x, y) in page.handles().items()
        }
