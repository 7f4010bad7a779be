"""What is on the screen at one time, and which widget receives the mouse and the keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactileq.experiments.console.drawing import Point
from tactileq.experiments.console.events import EventKind, KeyPress
from tactileq.experiments.console.notice import Notice
from tactileq.experiments.console.widgets import PRESSING, Button, FocusRing, Widget


class Page:
    """Widgets and decoration.

    Keys go to the widget that has the focus, which Tab and Shift-Tab move; a frame shows it. Enter
    presses the button in the frame; where there is none, be it that the frame is around something
    else or hidden while the mouse is used, the button that goes on. A shortcut presses its button
    wherever the focus is. What cannot be pressed says why.

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
        What has the focus at first; `goes_on` without it.
    goes_on : Button, optional
        What Enter presses where no other button is in the frame.
    shortcuts : mapping of key name to Button, optional
        "ctrl+1" is pressed together with Ctrl.
    notice : Notice, optional
        Says why something cannot be pressed.
    """

    def __init__(
        self,
        name: str,
        *,
        widgets: Sequence[Widget],
        decoration: Sequence[Any],
        ring: FocusRing | None = None,
        focus: Widget | None = None,
        goes_on: Button | None = None,
        shortcuts: Mapping[str, Button] | None = None,
        notice: Notice | None = None,
    ) -> None:
        self.name = name
        self._widgets = tuple(widgets)
        self._decoration = (*decoration, *([] if notice is None else [notice]))
        self._ring = ring
        self._focus = focus or goes_on
        self._goes_on = goes_on
        self._shortcuts = dict(shortcuts or {})
        self._notice = notice
        self._held: Widget | None = None

    # --- The mouse ----------------------------------------------------------------------------

    def handle(self, kind: EventKind, point: Point) -> None:
        """Pass a mouse event to the widget on which the press began."""
        if kind == "press":
            self._show_focus(False)
            self._begin_press(next((w for w in self._widgets if w.contains(point)), None), point)
        elif self._held is not None and kind == "drag":
            self._held.drag(point)
        elif self._held is not None:
            widget, self._held = self._held, None
            widget.release(point)

    def _begin_press(self, widget: Widget | None, point: Point) -> None:
        self._held = None
        self._say(widget.needs if widget is not None else "")
        if widget is not None and not widget.needs:
            self._held = widget
            self._focus = _after(widget)
            widget.press(point)

    def let_go(self) -> None:
        """Forget a press that has not ended; its end will not be reported."""
        if self._held is not None:
            self._held.cancel()
        self._held = None

    # --- Keys ---------------------------------------------------------------------------------

    def handle_key(self, key: KeyPress) -> None:
        """Move the focus, press a button, or pass the key on to what has the focus."""
        self._say("")
        shortcut = self._shortcuts.get(f"ctrl+{key.name}" if key.ctrl else key.name)
        if key.ctrl and shortcut is None:
            return
        button = self._pressed_by(key) if shortcut is None else shortcut
        if key.name == "tab":
            self._move_focus(-1 if key.shift else 1)
        elif button is not None:
            self._press(button)
        elif key.name == "enter":
            self._say_keys()
        elif self._focus is not None:
            self._focus.key(key)
        self._show_focus(True)

    def _pressed_by(self, key: KeyPress) -> Button | None:
        """What Enter or Space presses: the button in the frame, else Enter what goes on."""
        if key.name not in PRESSING:
            return None
        if self._shows_focus and isinstance(self._focus, Button):
            return self._focus
        return self._goes_on if key.name == "enter" else None

    def _press(self, button: Button) -> None:
        self._say(button.needs)
        if not button.needs:
            button.key(KeyPress("enter"))
            if button.then is not None:
                self._focus = button.then

    def _move_focus(self, step: int) -> None:
        reached = [w for w in self._widgets if not w.needs]
        if not reached or (self._focus in reached and not self._shows_focus):
            return  # which shows it first: it may not be where one would look for it
        if self._focus in reached:
            index = reached.index(self._focus) + step
        elif self._focus in self._widgets:  # it cannot be pressed: on from where it stands
            before = self._widgets[: self._widgets.index(self._focus)]
            index = sum(not w.needs for w in before) + min(step, 0)
        else:
            index = 0 if step > 0 else -1
        self._focus = reached[index % len(reached)]

    @property
    def _shows_focus(self) -> bool:
        return self._ring is not None and self._ring.visible

    def _show_focus(self, visible: bool) -> None:
        if self._ring is not None:
            self._ring.visible = visible

    # --- What is said and drawn ---------------------------------------------------------------

    def _say(self, needs: str) -> None:
        """Say why something was refused; of the last press or key only."""
        if self._notice is not None:
            self._notice.refuse(needs)

    def _say_keys(self) -> None:
        if self._notice is not None:
            self._notice.refuse(self._notice.keys)

    def draw(self) -> None:
        """Draw everything on the page."""
        for part in (*self._decoration, *self._widgets):
            part.draw()
        if self._ring is not None and self._focus is not None and not self._focus.needs:
            self._ring.draw(self._focus.box)

    def handles(self) -> dict[str, Point]:
        """Named points of all widgets."""
        return {name: at for widget in self._widgets for name, at in widget.handles().items()}


def _after(widget: Widget) -> Widget:
    """What has the focus after a press on this widget."""
    return (widget.then if isinstance(widget, Button) else None) or widget
