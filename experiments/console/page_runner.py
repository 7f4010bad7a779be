"""Shows one page after another, lets the participant stop on each, and handles every event."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from tactileq.experiments.console.drawing import CONSOLE_ORANGE
from tactileq.experiments.console.events import KeyPress, Keys, Mouse
from tactileq.experiments.console.languages import Texts
from tactileq.experiments.console.notice import Notice
from tactileq.experiments.console.page import Page
from tactileq.experiments.console.parts import PageParts
from tactileq.experiments.console.widgets import Button, FocusRing, Widget
from tactileq.experiments.sessions.loop.people import SessionAborted
from tactileq.experiments.sessions.loop.surfaces import Note, Surfaces

# --- Parameters -----------------------------------------------------------------------------

FRAME_PAUSE_S = 0.004  # keeps a display without vertical synchronisation from spinning
NOT_STATED = "not stated"  # first of all, since nobody owes a reason
REASONS = (NOT_STATED, "tired", "discomfort", "time", "device", "other")
REASONS_TOP, REASONS_PITCH = 0.145, 0.08
NOTICE_Y = -0.32  # of pages with their buttons at the foot

# Called when a page has come up: its name, and the window's pixel (from the top left) of each
# handle.
PageHook = Callable[[str, Mapping[str, tuple[int, int]]], None]


def _unheard(event: str, **fields: object) -> None:
    """Where events go before anybody listens."""


class PageRunner(PageParts):
    """A window on which pages are shown, one after another.

    Parameters
    ----------
    window : psychopy.visual.Window
    stamp : str
        What every page is stamped with, in the participant's language.
    on_page : callable, optional
        Called with each page that is shown.
    """

    def __init__(self, window: Any, texts: Texts, *, stamp: str, on_page: PageHook | None) -> None:
        super().__init__(window, texts)
        self.note: Note = _unheard
        self.follow: Callable[[str], None] = _unheard
        self._stamp = stamp
        self._on_page = on_page
        self._mouse, self._keys = Mouse(window), Keys(window)
        self._ring = FocusRing(window)
        self._finished = False
        self._wants_to_stop = False
        window.winHandle.push_handlers(on_close=self._ask_later)

    # --- Showing a page ---------------------------------------------------------------------

    def finish(self) -> None:
        """End the page that is shown."""
        self._finished = True

    def proceed(self, label: str | None = None, *, y: float = -0.385) -> Button:
        """The button that finishes a page."""
        label = label or self.texts.of("button.continue")
        return self.button("continue", label, at=(0.0, y), action=self.finish)

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
        goes_on: Button | None = None,
        shortcuts: Mapping[str, Button] | None = None,
        notice: Notice | None = None,
        stoppable: bool = True,
    ) -> None:
        """Show a page until it is finished.

        Parameters
        ----------
        name : str
            By which tests know it.
        widgets, decoration, focus, goes_on, shortcuts, notice
            As of `Page`.
        update : callable
            Called before each frame and after each event.
        surfaces : Surfaces, optional
            What can be felt; presented from the first frame on, and not while the participant is
            asked whether to stop.
        until : callable, optional
            Ends the page as soon as it is true.
        stoppable : bool
            Whether Escape and a button ask to stop; else Escape ends the page.

        Raises
        ------
        SessionAborted
            If the participant stops the session.
        """
        stop = [self.stop_button(self._ask_soon)] if stoppable else []
        stamp = [self.stamped(self._stamp)] if self._stamp else []
        page = Page(
            name,
            widgets=[*widgets, *stop],
            decoration=[*stamp, *decoration],
            ring=self._ring,
            focus=focus,
            goes_on=goes_on,
            shortcuts=shortcuts,
            notice=notice,
        )
        ended = until or (lambda: False)
        self._begin(page, update, surfaces=surfaces)
        while not self._finished and not ended():
            self._respond(page, update, surfaces=surfaces)
            if self._wants_to_stop and not self._finished:
                if not stoppable:
                    return
                page.let_go()
                self._ask_to_stop(surfaces)
                self._begin(page, update, surfaces=surfaces)
            self._frame(page, update)

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
        self.follow(page.name)
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
        acts = [partial(page.handle, kind, point) for kind, point in self._mouse.take()]
        acts += [partial(self._key, page, key) for key in self._keys.take()]
        for act in acts:
            act()
            update()  # the next event may be for a button that this one has enabled
            if self._finished or self._wants_to_stop:
                return

    def _key(self, page: Page, key: KeyPress) -> None:
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
        """One of `REASONS`; None where the participant goes on, also by Escape.

        Before the first trial nobody is asked for one.
        """
        of = self.texts.of
        asked = REASONS if self.progress is not None else ()
        picked: list[str] = []
        said: list[str] = []

        def stop_now() -> None:
            said.append(picked[-1] if picked else NOT_STATED)
            self.finish()

        wide = partial(self.button, size=(0.44, 0.078))
        rows = [
            self.button(
                f"reason {reason}",
                of(f"stopping.{reason}"),
                at=(0.0, REASONS_TOP - REASONS_PITCH * row),
                size=(0.62, 0.066),
                action=partial(picked.append, reason),
            )
            for row, reason in enumerate(asked)
        ]
        go_on = wide("go on", of("stopping.go_on"), at=(-0.24, -0.385), action=self.finish)
        stop = wide(
            "stop now",
            of("stopping.stop"),
            at=(0.24, -0.385),
            action=stop_now,
            color=CONSOLE_ORANGE,
        )

        def update() -> None:
            for reason, button in zip(asked, rows, strict=True):
                button.lit = picked[-1:] == [reason]

        self.show(
            "stop",
            widgets=[*rows, go_on, stop],
            decoration=[
                self.title(of("stopping.title"), y=0.33),
                self.body(of("stopping.text" if asked else "stopping.at_first"), y=0.24),
                self.keys(of("keys")),
            ],
            update=update,
            focus=go_on,  # who came here by mistake is back by one key
            notice=self.notice(NOTICE_Y),
            stoppable=False,
        )
        return said[-1] if said else None
