"""Shows one page after another, lets the participant stop on each, and minds every event."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from experiments.console.drawing import (
    BLUE,
    GREY,
    ORANGE,
    PALE,
    SMALL_HEIGHT,
    TEXT_HEIGHT,
    TITLE_HEIGHT,
    Point,
    card,
    fitted,
    text,
)
from experiments.console.events import Key, Keys, Mouse
from experiments.console.languages import Texts
from experiments.console.page import Page
from experiments.console.widgets import Button, FocusRing, Widget
from experiments.sessions.surfaces import Note, SessionAborted, Surfaces

# --- Parameters -----------------------------------------------------------------------------

FRAME_PAUSE_S = 0.004  # keeps a display without vertical synchronisation from spinning
REASONS = ("tired", "discomfort", "time", "device", "other")
TOP_Y, FOOT_Y = 0.462, -0.465
HALF_WIDTH = 0.645  # of what every window shows
FOOT_HEIGHT = 0.02
BAR = (0.24, 0.006)

# Called when a page has come up: its name, and the window's pixel (from the top left) of each
# handle.
PageHook = Callable[[str, Mapping[str, tuple[int, int]]], None]


def _unheard(event: str, **fields: object) -> None:
    """Where events go before anybody listens."""


class PageRunner:
    """A window on which pages are shown, and what all of them have in common.

    Parameters
    ----------
    window : psychopy.visual.Window
    texts : Texts
    stamp : str
        What every page is stamped with, in the participant's language.
    on_page : callable, optional
        Told of each page that has come up.
    """

    def __init__(self, window: Any, texts: Texts, *, stamp: str, on_page: PageHook | None) -> None:
        self.window, self.texts = window, texts
        self.note: Note = _unheard
        self.progress: tuple[int, int] | None = None
        self._stamp = stamp
        self._on_page = on_page
        self._mouse, self._keys = Mouse(window), Keys(window)
        self._ring = FocusRing(window)
        self._finished = False
        self._wants_to_stop = False
        window.winHandle.push_handlers(on_close=self._ask_later)

    # --- Parts of pages ---------------------------------------------------------------------

    def title(self, content: str, *, y: float = 0.395) -> Any:
        """What a page is about, on two lines at the most."""
        return fitted(
            self.window, content, box=(1.2, 0.13), height=TITLE_HEIGHT, at=(0.0, y), bold=True
        )

    def body(self, content: str, *, y: float = 0.02) -> Any:
        """Some sentences."""
        return fitted(
            self.window, content, box=(1.0, 0.26), height=TEXT_HEIGHT, at=(0.0, y), color=GREY
        )

    def remark(self, content: str, *, y: float, color: str = GREY) -> Any:
        """A line in small type."""
        return fitted(
            self.window, content, box=(1.2, 0.08), height=SMALL_HEIGHT, at=(0.0, y), color=color
        )

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
        options = {"size": size, "action": action, "color": color, "height": height}
        return Button(self.window, name, label=label, at=at, **options)

    def proceed(self, label: str | None = None, *, y: float = -0.385) -> Button:
        """The button that finishes a page."""
        label = label or self.texts.of("button.continue")
        return self.button("continue", label, at=(0.0, y), action=self.finish)

    def foot(self, keys: str) -> list[Any]:
        """Which keys a page of a trial knows, and how many trials are done."""
        parts = [
            text(
                self.window,
                keys,
                at=(HALF_WIDTH, FOOT_Y),
                height=FOOT_HEIGHT,
                color=GREY,
                anchor="right",
            )
        ]
        return parts if self.progress is None else [*parts, *self._progress(*self.progress)]

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
        told = text(
            self.window,
            f"{done} / {of}",
            at=(-HALF_WIDTH, FOOT_Y),
            height=FOOT_HEIGHT,
            color=GREY,
            anchor="left",
        )
        return [bar(BAR[0], PALE), *filled, told]

    def card(self, y: float, height: float) -> Any:
        """A card as wide as the page, on which widgets stand."""
        return card(self.window, box=(0.0, y, 1.16, height))

    # --- Showing a page ---------------------------------------------------------------------

    def finish(self) -> None:
        """End the page that is shown."""
        self._finished = True

    def show(
        self,
        name: str,
        *,
        widgets: Sequence[Widget],
        decoration: Sequence[Any],
        update: Callable[[], None] = lambda: None,
        surfaces: Surfaces | None = None,
        until: Callable[[], bool] | None = None,
        focus: Widget | None = None,
        shortcuts: Mapping[str, Button] | None = None,
    ) -> None:
        """Show a page until it is finished.

        Parameters
        ----------
        name : str
            By which tests know it.
        widgets, decoration, focus, shortcuts
            As of `Page`.
        update : callable
            Called before each frame and after each event.
        surfaces : Surfaces, optional
            What can be felt; presented from the first frame on, and not while the participant is
            asked whether to stop.
        until : callable, optional
            Ends the page as soon as it is true.

        Raises
        ------
        SessionAborted
            Where the participant stops the session.
        """
        stop = self.button(
            "stop",
            self.texts.of("button.stop"),
            at=(HALF_WIDTH - 0.055, TOP_Y),
            size=(0.11, 0.044),
            action=self._ask_soon,
            color=GREY,
            height=FOOT_HEIGHT,
        )
        stop.lit = False
        page = self._page(
            name, widgets=[*widgets, stop], decoration=decoration, focus=focus, shortcuts=shortcuts
        )
        ended = until or (lambda: False)
        self._begin(page, update, surfaces=surfaces)
        while not self._finished and not ended():
            self._respond(page, update, surfaces=surfaces)
            if self._wants_to_stop and not self._finished:
                page.let_go()
                self._ask_to_stop(surfaces)
                self._begin(page, update, surfaces=surfaces)
            self._frame(page, update)

    def _page(self, name: str, *, decoration: Sequence[Any], **parts: Any) -> Page:
        stamps = [self._stamped()] if self._stamp else []
        return Page(name, decoration=[*stamps, *decoration], ring=self._ring, **parts)

    def _stamped(self) -> Any:
        return text(
            self.window,
            self._stamp,
            at=(-HALF_WIDTH, TOP_Y),
            height=SMALL_HEIGHT,
            color=ORANGE,
            bold=True,
            anchor="left",
        )

    def _begin(
        self, page: Page, update: Callable[[], None], *, surfaces: Surfaces | None = None
    ) -> None:
        """The first frame of a page, and with it the first presentation."""
        self._finished = self._wants_to_stop = False
        update()
        page.draw()
        if surfaces is not None and not surfaces.started:
            # The page is complete and drawn: its frame and the surface begin together.
            self.window.callOnFlip(surfaces.start)
        self.window.flip()
        self._mouse.take()  # what was pressed before the page could be seen is not for it
        self._keys.take()
        if self._on_page is not None:
            self._on_page(page.name, self._pixels(page))

    def _frame(self, page: Page, update: Callable[[], None]) -> None:
        update()
        page.draw()
        self.window.flip()
        time.sleep(FRAME_PAUSE_S)

    def _respond(
        self, page: Page, update: Callable[[], None], *, surfaces: Surfaces | None
    ) -> None:
        """Pass on what the hands did since the last frame, as far as it is for this page."""
        if surfaces is not None:
            surfaces.follow_rig_button()
        acts: list[Callable[[], None]] = [
            lambda kind=kind, point=point: page.handle(kind, point)
            for kind, point in self._mouse.take()
        ]
        acts += [lambda key=key: self._key(page, key) for key in self._keys.take()]
        for act in acts:
            act()
            update()  # the next event may be for a button that this one has enabled
            if self._finished or self._wants_to_stop:
                return

    def _key(self, page: Page, key: Key) -> None:
        if key.name == "escape":
            self._ask_soon()
        else:
            page.handle_key(key)

    def _pixels(self, page: Page) -> dict[str, tuple[int, int]]:
        width, height = self.window.winHandle.get_size()
        return {
            name: (round(width / 2 + x * height), round(height / 2 - y * height))
            for name, (x, y) in page.handles().items()
        }

    # --- Stopping ---------------------------------------------------------------------------

    def _ask_soon(self) -> None:
        self._wants_to_stop = True

    def _ask_later(self) -> bool:
        """The window's own button: pyglet would close it in the middle of a frame."""
        self._wants_to_stop = True
        return True

    def _ask_to_stop(self, surfaces: Surfaces | None) -> None:
        """Ask again, in silence; SessionAborted with a reason, or on with the page before."""
        if surfaces is not None:
            surfaces.pause()
        self.note("stop_asked")
        reason = self._reason_to_stop()
        if reason is not None:
            raise SessionAborted(reason, by="participant")
        self.note("stop_withdrawn")
        if surfaces is not None:
            surfaces.resume()

    def _reason_to_stop(self) -> str | None:
        """One of `REASONS`; None where the participant goes on, also by Escape."""
        of = self.texts.of
        picked: list[str] = []
        rows = [
            self.button(
                f"reason {reason}",
                of(f"stopping.{reason}"),
                at=(0.0, 0.13 - 0.083 * row),
                size=(0.62, 0.07),
                action=lambda reason=reason: picked.append(reason),
            )
            for row, reason in enumerate(REASONS)
        ]
        go_on = self.button(
            "go on",
            of("stopping.go_on"),
            at=(-0.24, -0.385),
            size=(0.44, 0.078),
            action=self.finish,
        )
        stopped: list[str] = []
        stop = self.button(
            "stop now",
            of("stopping.stop"),
            at=(0.24, -0.385),
            size=(0.44, 0.078),
            action=lambda: (stopped.extend(picked[-1:]), self.finish())[0],
            color=ORANGE,
        )

        def update() -> None:
            stop.enabled = bool(picked)
            for reason, button in zip(REASONS, rows, strict=True):
                button.lit = picked[-1:] == [reason]

        page = self._page(
            "stop",
            widgets=[*rows, go_on, stop],
            decoration=[
                self.title(of("stopping.title"), y=0.33),
                self.body(of("stopping.text"), y=0.235),
            ],
        )
        self._begin(page, update)
        while not self._finished:
            self._respond(page, update, surfaces=None)
            if self._wants_to_stop:
                return None
            self._frame(page, update)
        return stopped[-1] if stopped else None
