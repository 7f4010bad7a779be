"""Screens, numbered as PsychoPy's windows number them, and a window on one of them."""

from __future__ import annotations

import sys
from typing import Any

from tactileq.experiments.console.drawing import PAPER
from tactileq.modeling import InputError
from tactileq.modeling.extras import extra


def open_window(*, size: tuple[int, int], fullscreen: bool, screen: int) -> Any:
    """A PsychoPy window in the unit `height`.

    Raises
    ------
    InputError
        For a screen that does not exist, where there is none at all, and without PsychoPy.
    """
    try:
        with extra("console"):
            from psychopy import logging, visual

        check_screen(screen)
        logging.console.setLevel(logging.ERROR)  # no monitor calibration is needed: not a warning
        return visual.Window(
            size=size_within(size, _screen_size(screen)),
            fullscr=fullscreen,
            screen=screen,
            units="height",
            color=PAPER,
            winType="pyglet",
            allowGUI=not fullscreen,
            checkTiming=False,
            multiSample=True,
            title="tactileq",
        )
    except InputError:
        raise
    except Exception as error:  # whatever the window system raises means the same to a user
        raise InputError(
            f"expected a screen for the window, got {error or type(error).__name__}; start a "
            "graphical session (or Xvfb) and set DISPLAY."
        ) from error


def check_screen(screen: int) -> None:
    """Refuse a screen that does not exist; PsychoPy would open another one instead.

    Raises
    ------
    InputError
        Naming how many there are.
    """
    count = _screen_count()
    if not 0 <= screen < count:
        there_are = "0, the only one" if count == 1 else f"0 to {count - 1}, of {count}"
        raise InputError(
            f"expected the number of a screen ({there_are}), got {screen}; choose an "
            "existing one, or connect another."
        )


def size_within(wanted: tuple[int, int], screen: tuple[int, int]) -> tuple[int, int]:
    """The largest size up to the wanted one that a screen shows whole, at least as wide as 4:3."""
    width = min(wanted[0], screen[0])
    return width, min(wanted[1], screen[1], width * 3 // 4)


def _screen_size(screen: int) -> tuple[int, int]:
    import pyglet  # late: needs a display

    # Where monitors are screens of their own, pyglet lists the first one alone: all of one size.
    there = pyglet.canvas.get_display().get_screens()
    one = there[min(screen, len(there) - 1)]
    return one.width, one.height


def _screen_count() -> int:
    import pyglet  # late: needs a display

    display = pyglet.canvas.get_display()
    count = len(display.get_screens())
    if sys.platform.startswith("linux"):
        # Monitors are parts of one screen of the X server (Xinerama), or screens of their own.
        count = max(count, int(pyglet.libs.x11.xlib.XScreenCount(display._display)))
    return count
