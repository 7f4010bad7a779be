"""Which screens there are, numbered as PsychoPy's windows number them."""

from __future__ import annotations

import sys

from modeling import InputError


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
            f"expected the number of a screen ({there_are}), got {screen}; choose one that is "
            "there, or connect another."
        )


def _screen_count() -> int:
    import pyglet  # late: needs a display

    display = pyglet.canvas.get_display()
    count = len(display.get_screens())
    if sys.platform.startswith("linux"):
        # Monitors are parts of one screen of the X server (Xinerama), or screens of their own.
        count = max(count, int(pyglet.libs.x11.xlib.XScreenCount(display._display)))
    return count
