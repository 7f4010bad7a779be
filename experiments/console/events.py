"""Input events: presses of the mouse and of keys, each as an event, none lost between frames."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from tactileq.experiments.console.drawing import Point

EventKind = Literal["press", "drag", "release"]
LEFT_BUTTON = 1
TAB_ON_X = 23  # code of the Tab key, by which alone pyglet knows it while Shift is held


class Mouse:
    """The left mouse button's presses, drags and releases, none lost between frames."""

    def __init__(self, window: Any) -> None:
        self._handle = window.winHandle
        self._events: list[tuple[EventKind, Point]] = []
        self._handle.push_handlers(
            on_mouse_press=lambda x, y, button, _keys: self._note("press", x, y, button),
            on_mouse_drag=lambda x, y, _dx, _dy, held, _keys: self._note("drag", x, y, held & 1),
            on_mouse_release=lambda x, y, button, _keys: self._note("release", x, y, button),
        )

    def take(self) -> list[tuple[EventKind, Point]]:
        """The events since the last call, in order."""
        events, self._events = self._events, []
        return events

    def _note(self, kind: EventKind, x: float, y: float, button: int) -> None:
        if button == LEFT_BUTTON:
            width, height = self._handle.get_size()
            self._events.append((kind, ((x - width / 2) / height, (y - height / 2) / height)))


class KeyPress(NamedTuple):
    """A press of a key: its small name ("tab", "enter", "7", "left"), with shift or ctrl held."""

    name: str
    shift: bool = False
    ctrl: bool = False


class Keys:
    """Presses of keys; those that move or delete repeat while they are held.

    PsychoPy's other back ends for keys see none on a display without a keyboard of its own.
    """

    def __init__(self, window: Any) -> None:
        from pyglet.window import key

        self._names = key
        self._handle = window.winHandle
        self._presses: list[KeyPress] = []
        window.winHandle.push_handlers(
            on_key_press=self._press,
            on_key_release=self._release,
            on_text_motion=lambda motion: self._add(motion, shift=False),
            on_text_motion_select=lambda motion: self._add(motion, shift=True),
        )

    def take(self) -> list[KeyPress]:
        """The presses since the last call, in order."""
        presses, self._presses = self._presses, []
        return presses

    def _press(self, symbol: int, modifiers: int) -> bool:
        names = self._names
        repeated = {  # they arrive as motions as well, and again while they are held
            *(names.LEFT, names.RIGHT, names.UP, names.DOWN, names.PAGEUP, names.PAGEDOWN),
            *(names.BACKSPACE, names.DELETE),
        }
        if symbol == names.user_key(TAB_ON_X):
            symbol = names.TAB
        if symbol not in repeated and not modifiers & names.MOD_ALT:
            shift, ctrl = (bool(modifiers & held) for held in (names.MOD_SHIFT, names.MOD_CTRL))
            self._add(symbol, shift=shift, ctrl=ctrl)
        return True  # pyglet would close the window at Escape

    def _release(self, symbol: int, _modifiers: int) -> None:
        # On X, where Shift is let go before Tab, pyglet would take Shift-Tab for held ever after.
        if symbol == self._names.TAB and hasattr(self._handle, "pressed_keys"):
            self._handle.pressed_keys.discard(self._names.user_key(TAB_ON_X))

    def _add(self, symbol: int, *, shift: bool, ctrl: bool = False) -> bool:
        name = self._names.symbol_string(symbol).lower().removeprefix("motion_")
        name = name.removeprefix("num_").removeprefix("_")
        same = {"return": "enter", "previous_page": "pageup", "next_page": "pagedown"}
        self._presses.append(KeyPress(same.get(name, name), shift, ctrl))
        return True
