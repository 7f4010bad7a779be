"""Buttons and rating scales on a PsychoPy window, operated by events of the mouse and of keys.

PsychoPy's own widgets ask once per frame where the mouse is: a click within a frame is lost to
them, and a press elsewhere that is dragged in counts. Here each press and release arrives as an
event, and a widget reacts only to a press that began on it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from tactileq.experiments.console.drawing import (
    BLUE,
    CARD,
    CONSOLE_GREY,
    INK,
    PALE,
    SMALL_HEIGHT,
    TEXT_HEIGHT,
    Box,
    Point,
    fitted,
    rounded,
    text,
)
from tactileq.experiments.console.events import KeyPress

PRESSING = ("enter", "space")
# How far a key moves a marker, in points; with shift, ten times as far.
MOVES = {"left": -1, "down": -1, "right": 1, "up": 1, "pagedown": -10, "pageup": 10}
FARTHER = 10
RING_GAP = 0.008


class Widget(Protocol):
    """What a page needs of the things on it."""

    name: str
    needs: str  # why it cannot be pressed now; empty where it can

    @property
    def box(self) -> Box:
        """Where it is."""
        ...

    def contains(self, point: Point) -> bool:
        """Whether a press at this point is one on the widget."""
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

    def cancel(self) -> None:
        """Forget a press whose end will not be reported."""
        ...

    def key(self, key: KeyPress) -> None:
        """A key was pressed while the widget had the focus."""
        ...

    def draw(self) -> None:
        """Draw the present state."""
        ...

    def handles(self) -> dict[str, Point]:
        """Named points by which the widget can be taken."""
        ...


class Button:
    """A button that acts when it is pressed and let go on it, while nothing else is needed first.

    Parameters
    ----------
    window : psychopy.visual.Window
    name : str
        By which tests find it.
    at, size : (x, y)
        Middle, and width and height.
    color : str
        Of the button while it is lit.
    height : float
        Of the label.

    Attributes
    ----------
    needs : str
        Why it cannot be pressed now, as the page says to who tries; empty where it can.
    lit : bool or None
        Whether it is filled; by default as long as it can be pressed.
    then : Button or None
        Where the focus goes from here once it was pressed: from an answer to what goes on.
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
        self.needs = ""
        self.lit: bool | None = None
        self.then: Button | None = None
        self._at, self._size = at, size
        self._action = action
        self._color = color
        self._held = False
        self._looks: tuple[bool, bool, bool] | None = None  # when drawn last
        self._shape = visual.ShapeStim(
            window, vertices=rounded(size, 0.014), pos=at, units="height", autoLog=False
        )
        self._label = fitted(
            window, label, box=(size[0] - 0.012, size[1]), height=height, at=at, bold=True
        )

    @property
    def box(self) -> Box:
        """Where it is."""
        return (*self._at, *self._size)

    def contains(self, point: Point) -> bool:
        """Whether the point lies on the button."""
        across = abs(point[0] - self._at[0]) <= self._size[0] / 2
        upright = abs(point[1] - self._at[1]) <= self._size[1] / 2
        return across and upright

    def press(self, point: Point) -> None:
        """Show that the button is held."""
        self._held = True

    def drag(self, point: Point) -> None:
        """Show whether letting go now would act."""
        self._held = self.contains(point)

    def release(self, point: Point) -> None:
        """Act if the mouse is still on the button."""
        self._held = False
        if self.contains(point) and not self.needs:
            self._action()

    def cancel(self) -> None:
        """Forget that the button is held."""
        self._held = False

    def key(self, key: KeyPress) -> None:
        """Act at Enter or Space."""
        if key.name in PRESSING and not self.needs:
            self._action()

    def draw(self) -> None:
        """Filled while lit, outlined while not, pale while something else is needed first."""
        filled = not self.needs if self.lit is None else self.lit
        looks = (filled, filled or not self.needs, self._held)
        if looks != self._looks:  # PsychoPy takes a millisecond to set the colours of a button
            self._looks = looks
            self._color_parts(*looks)
        self._shape.draw()
        self._label.draw()

    def _color_parts(self, filled: bool, colored: bool, held: bool) -> None:
        self._shape.fillColor = self._color if filled else CARD
        self._shape.lineColor = self._color if colored else PALE
        self._shape.lineWidth = 5 if held else 2
        self._label.color = CARD if filled else (self._color if colored else CONSOLE_GREY)

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
    told : callable
        Called with each rating, 0 … 100.
    """

    needs = ""

    def __init__(
        self,
        window: Any,
        name: str,
        *,
        label: str,
        ends: tuple[str, str],
        at: Point,
        width: float,
        changed: Callable[[float], None],
    ) -> None:
        from psychopy import visual

        self.name = name
        self._at, self._width = at, width
        self._changed = changed
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
            lineColor=CONSOLE_GREY,
            autoLog=False,
        )
        left, right, below = at[0] - width / 2, at[0] + width / 2, at[1] - 0.05
        self._texts = [
            text(window, label, at=(at[0], at[1] + 0.065), bold=True),
            text(
                window,
                ends[0],
                at=(left, below),
                height=SMALL_HEIGHT,
                color=CONSOLE_GREY,
                anchor="left",
            ),
            text(
                window,
                ends[1],
                at=(right, below),
                height=SMALL_HEIGHT,
                color=CONSOLE_GREY,
                anchor="right",
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

    @property
    def box(self) -> Box:
        """Where the line is."""
        return (*self._at, self._width + 0.06, 0.05)

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
        self._rate(self._value(point))

    def cancel(self) -> None:
        """Put the marker back to the rating, if there is one."""
        self._slider.markerPos = self._slider.getRating()

    def key(self, key: KeyPress) -> None:
        """Move the marker by a point, or by ten.

        The first key puts it to the end from which it would come: to the right, to 0; to the
        left, to 100. A marker that appeared in the middle would suggest an answer.
        """
        step = MOVES.get(key.name)
        if step is None:
            return
        if not self.rated:
            self._rate(0.0 if step > 0 else 100.0)
            return
        far = step * FARTHER if key.shift and abs(step) == 1 else step
        self._rate(min(max(self.rating + far, 0.0), 100.0))

    def _rate(self, value: float) -> None:
        self._slider.recordRating(value)
        self._changed(value)

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


class FocusRing:
    """Shows where keys go: until the mouse is pressed, and from the next key on again.

    Who works with the mouse alone sees it on the first page at most.
    """

    def __init__(self, window: Any) -> None:
        from psychopy import visual

        self.visible = True
        self._shape = visual.Rect(
            window,
            units="height",
            fillColor=None,
            lineColor=INK,
            lineWidth=3,
            autoLog=False,
        )

    def draw(self, box: Box) -> None:
        """Draw it around a box, if it is visible."""
        if self.visible:
            self._shape.pos = box[:2]
            self._shape.size = (box[2] + 2 * RING_GAP, box[3] + 2 * RING_GAP)
            self._shape.draw()
