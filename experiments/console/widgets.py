"""Buttons, rating scales and pages on a PsychoPy window, operated by mouse events.

PsychoPy's own widgets ask once per frame where the mouse is: a click within a frame is lost to
them, and a press elsewhere that is dragged in counts. Here each press and release arrives as an
event, and a widget reacts only to a press that began on it.

Positions and sizes are in PsychoPy's unit `height`: (0, 0) is the middle of the window, 1 its
height. Everything fits a window of at least 4:3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, Protocol

Point = tuple[float, float]
EventKind = Literal["press", "drag", "release"]

# Okabe and Ito's colours, told apart by colour-blind people too.
BLUE = "#0072B2"
ORANGE = "#D55E00"
INK = "#1F2328"
GREY = "#5B6470"
PALE = "#C9CFD6"
CARD = "#FFFFFF"
PAPER = "#F4F5F7"

TITLE_HEIGHT = 0.046
TEXT_HEIGHT = 0.029
SMALL_HEIGHT = 0.024
LEFT_BUTTON = 1


def text(
    window: Any,
    content: str,
    *,
    at: Point,
    height: float = TEXT_HEIGHT,
    color: str = INK,
    bold: bool = False,
    wrap: float = 1.15,
    anchor: str = "center",
) -> Any:
    """A PsychoPy text in the type that comes with PsychoPy, the same on every machine."""
    import psychopy
    from psychopy import visual

    fonts = Path(psychopy.__file__).parent / "assets" / "fonts"
    return visual.TextStim(
        window,
        text=content,
        pos=at,
        height=height,
        color=color,
        bold=bold,
        wrapWidth=wrap,
        anchorHoriz=anchor,
        alignText=anchor,
        font="Noto Sans",
        fontFiles=[str(fonts / f"NotoSans-{weight}.ttf") for weight in ("Regular", "Bold")],
        units="height",
        autoLog=False,
    )


class Widget(Protocol):
    """What a page needs of the things on it."""

    name: str

    def contains(self, point: Point) -> bool:
        """Whether the widget reacts to a press at this point."""
        ...

    def press(self, point: Point) -> None:
        """A press began on the widget."""
        ...

    def drag(self, point: Point) -> None:
        """The mouse moved while held down since a press on the widget."""
        ...

    def release(self, point: Point) -> None:
        """The mouse was let go, wherever, after a press on the widget."""
        ...

    def draw(self) -> None:
        """Draw the present state."""
        ...

    def handles(self) -> dict[str, Point]:
        """Named points by which the widget can be taken."""
        ...


class Button:
    """A button that acts when it is pressed and let go on it, while enabled.

    Parameters
    ----------
    window : psychopy.visual.Window
    name : str
        By which tests find it.
    label : str
    at, size : (x, y)
        Middle, and width and height.
    action : callable
    color : str
        Of the button while it is lit.
    height : float
        Of the label.
    """

    def __init__(
        self,
        window: Any,
        name: str,
        *,
        label: str,
        at: Point,
        size: Point,
        action: Callable[[], None],
        color: str = BLUE,
        height: float = TEXT_HEIGHT,
    ) -> None:
        from psychopy import visual

        self.name = name
        self.enabled = True
        self.lit = True
        self._at, self._size = at, size
        self._action = action
        self._color = color
        self._held = False
        self._shape = visual.ShapeStim(
            window, vertices=rounded(size, 0.014), pos=at, units="height", autoLog=False
        )
        self._label = text(window, label, at=at, height=height, bold=True, wrap=size[0])

    def contains(self, point: Point) -> bool:
        """Whether the point lies on the enabled button."""
        across = abs(point[0] - self._at[0]) <= self._size[0] / 2
        upright = abs(point[1] - self._at[1]) <= self._size[1] / 2
        return self.enabled and across and upright

    def press(self, point: Point) -> None:
        """Show that the button is held."""
        self._held = True

    def drag(self, point: Point) -> None:
        """Show whether letting go now would act."""
        self._held = self.contains(point)

    def release(self, point: Point) -> None:
        """Act if the mouse is still on the button."""
        self._held = False
        if self.contains(point):
            self._action()

    def draw(self) -> None:
        """Filled while lit, outlined while not, pale while disabled."""
        lit = self.enabled and self.lit
        line = self._color if self.enabled else PALE
        self._shape.fillColor = self._color if lit else CARD
        self._shape.lineColor = line
        self._shape.lineWidth = 5 if self._held else 2
        self._label.color = CARD if lit else (self._color if self.enabled else GREY)
        self._shape.draw()
        self._label.draw()

    def handles(self) -> dict[str, Point]:
        """The button's middle."""
        return {self.name: self._at}


class RatingScale:
    """A visual analogue scale from 0 to 100 without a marker before the first rating.

    Parameters
    ----------
    window : psychopy.visual.Window
    name : str
        By which tests find it.
    label : str
        What is rated.
    ends : (str, str)
        What 0 and 100 mean.
    at : (x, y)
        Middle of the line.
    width : float
        Length of the line.
    """

    def __init__(
        self,
        window: Any,
        name: str,
        *,
        label: str,
        ends: tuple[str, str],
        at: Point,
        width: float,
    ) -> None:
        from psychopy import visual

        self.name = name
        self._at, self._width = at, width
        # Read-only: PsychoPy draws it and keeps the rating, this class minds the mouse.
        self._slider = visual.Slider(
            window,
            ticks=(0, 100),
            startValue=None,
            pos=at,
            size=(width, 0.036),
            units="height",
            granularity=0,
            readOnly=True,
            markerColor=BLUE,
            lineColor=GREY,
            autoLog=False,
        )
        left, right, below = at[0] - width / 2, at[0] + width / 2, at[1] - 0.05
        self._texts = [
            text(window, label, at=(at[0], at[1] + 0.065), bold=True),
            text(window, ends[0], at=(left, below), height=SMALL_HEIGHT, color=GREY, anchor="left"),
            text(
                window, ends[1], at=(right, below), height=SMALL_HEIGHT, color=GREY, anchor="right"
            ),
        ]

    @property
    def rated(self) -> bool:
        """Whether there is a rating yet."""
        return self._slider.getRating() is not None

    @property
    def rating(self) -> float:
        """0 … 100; NaN before the first rating."""
        return float(self._slider.getRating()) if self.rated else float("nan")

    def contains(self, point: Point) -> bool:
        """Whether the point lies on the line or near it."""
        across = abs(point[0] - self._at[0]) <= self._width / 2 + 0.02
        return across and abs(point[1] - self._at[1]) <= 0.03

    def press(self, point: Point) -> None:
        """Take the marker."""
        self._slider.markerPos = self._value(point)

    def drag(self, point: Point) -> None:
        """Move the marker, which stays on the line wherever the mouse goes."""
        self._slider.markerPos = self._value(point)

    def release(self, point: Point) -> None:
        """Rate where the marker was let go."""
        self._slider.recordRating(self._value(point))

    def _value(self, point: Point) -> float:
        share = (point[0] - self._at[0]) / self._width + 0.5
        return 100.0 * min(max(share, 0.0), 1.0)

    def draw(self) -> None:
        """The line, its meaning, and the marker if there is one."""
        self._slider.draw()
        for part in self._texts:
            part.draw()

    def handles(self) -> dict[str, Point]:
        """The two ends and the middle of the line."""
        x, y = self._at
        half = self._width / 2
        return {
            f"{self.name}:0": (x - half, y),
            f"{self.name}:50": (x, y),
            f"{self.name}:100": (x + half, y),
        }


class Page:
    """What is on the screen at one time.

    Parameters
    ----------
    name : str
        By which tests know it.
    widgets : sequence of Widget
    decoration : sequence
        PsychoPy stimuli that only need drawing.
    """

    def __init__(self, name: str, *, widgets: Sequence[Widget], decoration: Sequence[Any]) -> None:
        self.name = name
        self._widgets = tuple(widgets)
        self._decoration = tuple(decoration)
        self._held: Widget | None = None

    def handle(self, kind: EventKind, point: Point) -> None:
        """Pass a mouse event to the widget on which the press began."""
        if kind == "press":
            self._held = next((w for w in self._widgets if w.contains(point)), None)
            if self._held is not None:
                self._held.press(point)
        elif self._held is not None and kind == "drag":
            self._held.drag(point)
        elif self._held is not None:
            widget, self._held = self._held, None
            widget.release(point)

    def draw(self) -> None:
        """Draw everything on the page."""
        for part in (*self._decoration, *self._widgets):
            part.draw()

    def handles(self) -> dict[str, Point]:
        """Named points of all widgets."""
        return {name: at for widget in self._widgets for name, at in widget.handles().items()}


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


def rounded(size: Point, radius: float) -> list[Point]:
    """Vertices of a rectangle of this width and height with round corners, about (0, 0)."""
    import numpy as np

    corners = ((1, 1, 0), (-1, 1, 90), (-1, -1, 180), (1, -1, 270))
    return [
        (
            sx * (size[0] / 2 - radius) + radius * float(np.cos(np.radians(start + turn))),
            sy * (size[1] / 2 - radius) + radius * float(np.sin(np.radians(start + turn))),
        )
        for sx, sy, start in corners
        for turn in range(0, 91, 10)
    ]
