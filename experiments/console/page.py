"""What is on the screen at one time, and which widget receives the mouse and the keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactileq.experiments.console.drawing import Point
from tactileq.experiments.console.events import EventKind, KeyPress
from tactileq.experiments.console.widgets import Button, FocusRing, Widget


class Page:
    """Widgets and decoration.

    Tab and Shift-Tab move a focus, which is shown from then on; keys go to the widget that has
    it. A shortcut presses its button wherever the focus is.

    Parameters
    ----------
    name : str
        By which tests know it.
    widgets : sequence of Widget
        In the order in which Tab reaches them.
    decoration : sequence
        PsychoPy stimuli that only need drawing.
    ring : FocusRing, optional
        Shows where the focus is; without it nothing does.
    focus : Widget, optional
        What has the focus at first; nothing has without it.
    shortcuts : mapping of key name to Button, optional
        "ctrl+1" is pressed together with Ctrl.
    """

    def __init__(
        self,
        name: str,
        *,
        widgets: Sequence[Widget],
        decoration: Sequence[Any],
        ring: FocusRing | None = None,
        focus: Widget | None = None,
        shortcuts: Mapping[str, Button] | None = None,
    ) -> None:
        self.name = name
        self._widgets = tuple(widgets)
        self._decoration = tuple(decoration)
        self._ring = ring
        self._focus = focus
        self._shortcuts = dict(shortcuts or {})
        self._held: Widget | None = None

    def handle(self, kind: EventKind, point: Point) -> None:
        """Pass a mouse event to the widget on which the press began."""
        if kind == "press":
            self._held = next((w for w in self._widgets if w.contains(point)), None)
            if self._ring is not None:
                self._ring.visible = False
            if self._held is not None:
                self._focus = self._held
                self._held.press(point)
        elif self._held is not None and kind == "drag":
            self._held.drag(point)
        elif self._held is not None:
            widget, self._held = self._held, None
            widget.release(point)

    def handle_key(self, key: KeyPress) -> None:
        """Move the focus, press the button of a shortcut, or pass the key on."""
        shortcut = self._shortcuts.get(f"ctrl+{key.name}" if key.ctrl else key.name)
        if key.ctrl and shortcut is None:
            return
        if key.name == "tab":
            self._move_focus(-1 if key.shift else 1)
        elif shortcut is not None:
            shortcut.key(KeyPress("enter"))
        elif self._focus is not None:
            self._focus.key(key)

    def let_go(self) -> None:
        """Forget a press that has not ended; its end will not be reported."""
        if self._held is not None:
            self._held.cancel()
        self._held = None

    def _move_focus(self, step: int) -> None:
        if self._ring is not None:
            self._ring.visible = True
        reached = [w for w in self._widgets if w.enabled]
        if not reached:
            return
        if self._focus in reached:
            index = reached.index(self._focus) + step
        elif self._focus in self._widgets:  # it is disabled: on from where it stands
            before = self._widgets[: self._widgets.index(self._focus)]
            index = sum(w.enabled for w in before) + min(step, 0)
        else:
            index = 0 if step > 0 else -1
        self._focus = reached[index % len(reached)]

    def draw(self) -> None:
        """Draw everything on the page."""
        for part in (*self._decoration, *self._widgets):
            part.draw()
        if self._ring is not None and self._focus is not None and self._focus.enabled:
            self._ring.draw(self._focus.box)

    def handles(self) -> dict[str, Point]:
        """Named points of all widgets."""
        return {name: at for widget in self._widgets for name, at in widget.handles().items()}
