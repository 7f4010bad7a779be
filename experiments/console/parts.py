"""What pages are made of: titles, texts, buttons, and what all of them have in common."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from tactileq.experiments.console.drawing import (
    BLUE,
    CARD,
    CONSOLE_GREY,
    CONSOLE_ORANGE,
    INK,
    PALE,
    SMALL_HEIGHT,
    TEXT_HEIGHT,
    TITLE_HEIGHT,
    Point,
    card,
    fitted,
    text,
)
from tactileq.experiments.console.languages import Texts
from tactileq.experiments.console.notice import Notice
from tactileq.experiments.console.widgets import Button

# --- Parameters -----------------------------------------------------------------------------

TOP_Y, FOOT_Y = 0.462, -0.465
HALF_WIDTH = 0.645  # of what every window shows
FOOT_HEIGHT = 0.02
BAR = (0.24, 0.006)
PRACTICE_X, PRACTICE_SIZE = 0.4, (0.2, 0.044)


class PageParts:
    """Makes the parts of pages.

    Parameters
    ----------
    window : psychopy.visual.Window

    Attributes
    ----------
    progress : (int, int) or None
        How many trials of how many are done, shown at the foot of pages.
    """

    def __init__(self, window: Any, texts: Texts) -> None:
        self.window, self.texts = window, texts
        self.progress: tuple[int, int] | None = None

    def title(self, content: str, *, y: float = 0.395) -> Any:
        """What a page is about, on two lines at most."""
        return fitted(
            self.window, content, box=(1.2, 0.13), height=TITLE_HEIGHT, at=(0.0, y), bold=True
        )

    def body(self, content: str, *, y: float = 0.02) -> Any:
        """Some sentences."""
        return fitted(
            self.window,
            content,
            box=(1.0, 0.26),
            height=TEXT_HEIGHT,
            at=(0.0, y),
            color=CONSOLE_GREY,
        )

    def remark(
        self, content: str, *, y: float, color: str = CONSOLE_GREY, bold: bool = False
    ) -> Any:
        """A line in small type."""
        return fitted(
            self.window,
            content,
            box=(1.2, 0.08),
            height=SMALL_HEIGHT,
            at=(0.0, y),
            color=color,
            bold=bold,
        )

    def notice(self, y: float) -> Notice:
        """The line that says what is needed, and why something was refused."""
        return Notice(partial(self.remark, y=y), keys=self.texts.of("keys"))

    def button(
        self,
        name: str,
        label: str,
        *,
        at: Point,
        action: Callable[[], None],
        size: Point = (0.33, 0.078),
        color: str = BLUE,
        height: float = TEXT_HEIGHT,
    ) -> Button:
        """A button with a label."""
        return Button(
            self.window,
            name,
            label=label,
            at=at,
            size=size,
            action=action,
            color=color,
            height=height,
        )

    def keys(self, content: str) -> Any:
        """Which keys a page knows, at its foot."""
        return text(
            self.window,
            content,
            at=(HALF_WIDTH, FOOT_Y),
            height=FOOT_HEIGHT,
            color=CONSOLE_GREY,
            anchor="right",
        )

    def foot(self, keys: str) -> list[Any]:
        """Which keys a page of a trial knows, and how many trials are done."""
        done = () if self.progress is None else self._progress(*self.progress)
        return [self.keys(keys), *done]

    def _progress(self, done: int, of: int) -> list[Any]:
        from psychopy import visual

        def bar(width: float, color: str) -> Any:
            at = (-HALF_WIDTH + 0.11 + width / 2, FOOT_Y)
            options = {"units": "height", "lineColor": None, "autoLog": False}
            return visual.Rect(
                self.window, pos=at, size=(width, BAR[1]), fillColor=color, **options
            )

        share = min(max(done / of, 0.0), 1.0) if of else 0.0
        filled = [bar(share * BAR[0], BLUE)] if share > 0 else []
        counted_text = text(
            self.window,
            f"{done} / {of}",
            at=(-HALF_WIDTH, FOOT_Y),
            height=FOOT_HEIGHT,
            color=CONSOLE_GREY,
            anchor="left",
        )
        return [bar(BAR[0], PALE), *filled, counted_text]

    def card(self, y: float, height: float) -> Any:
        """A card as wide as the page, on which widgets stand."""
        return card(self.window, box=(0.0, y, 1.16, height))

    def stamped(self, words: str) -> Any:
        """What every page is stamped with."""
        return text(
            self.window,
            words,
            at=(-HALF_WIDTH, TOP_Y),
            height=SMALL_HEIGHT,
            color=CONSOLE_ORANGE,
            bold=True,
            anchor="left",
        )

    def practice_mark(self) -> list[Any]:
        """What every page of a trial for practice is marked with."""
        at = (PRACTICE_X, TOP_Y)
        return [
            card(self.window, box=(*at, *PRACTICE_SIZE), color=INK),
            text(
                self.window,
                self.texts.of("practice"),
                at=at,
                height=SMALL_HEIGHT,
                color=CARD,
                bold=True,
            ),
        ]

    def stop_button(self, action: Callable[[], None]) -> Button:
        """The small button in the corner of every page."""
        button = self.button(
            "stop",
            self.texts.of("button.stop"),
            at=(HALF_WIDTH - 0.055, TOP_Y),
            size=(0.11, 0.044),
            action=action,
            color=CONSOLE_GREY,
            height=FOOT_HEIGHT,
        )
        button.lit = False
        return button
