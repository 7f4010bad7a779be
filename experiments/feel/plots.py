"""Axes, curves and markers on a PsychoPy window, few stimuli and cheap to move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from tactileq.experiments.console.drawing import CARD, CONSOLE_GREY, INK, PALE, Point, card, text
from tactileq.modeling.arrays import Floats

TICK_HEIGHT = 0.019
TICK_GAP = 0.008
PIXELS = 800  # height of a window in which lines are as wide as they say
Kind = Literal["log", "linear"]


@dataclass(frozen=True, kw_only=True)
class Scale:
    """One axis: its ends, whether it is logarithmic, and its ticks with their labels."""

    ends: tuple[float, float]
    kind: Kind
    ticks: Sequence[float]
    labels: Sequence[str]

    def share(self, values: ArrayLike) -> Floats:
        """Where values are between the ends, 0 … 1; values beyond stand at the nearer end."""
        bounded = np.clip(np.asarray(values, dtype=np.float64), *self.ends)
        low, high = self.ends
        if self.kind == "log":
            bounded, low, high = np.log(bounded), float(np.log(low)), float(np.log(high))
        share: Floats = (bounded - low) / (high - low)
        return share


@dataclass(frozen=True, kw_only=True)
class Axes:
    """A rectangle on the window with two scales; (left, bottom, right, top) in `height`."""

    box: tuple[float, float, float, float]
    x: Scale
    y: Scale

    def points(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """Positions (n, 2) on the window of n points, those beyond the axes on their edge."""
        left, bottom, right, top = self.box
        across = left + (right - left) * self.x.share(x)
        up = bottom + (top - bottom) * self.y.share(y)
        return np.stack([across, np.broadcast_to(up, across.shape)], axis=-1)

    def decoration(self, window: Any, *, label_x: bool = True) -> list[Any]:
        """Frame, grid lines and the ticks' labels."""
        left, bottom, right, top = self.box
        parts: list[Any] = []
        for (x, _), label in zip(
            self.points(self.x.ticks, self.y.ends[0]), self.x.labels, strict=True
        ):
            parts.append(line(window, [(x, bottom), (x, top)], color=PALE, width=1))
            if label_x:
                at = (float(x), bottom - TICK_GAP - TICK_HEIGHT / 2)
                parts.append(text(window, label, at=at, height=TICK_HEIGHT, color=CONSOLE_GREY))
        for (_, y), label in zip(
            self.points([self.x.ends[0]] * len(self.y.ticks), self.y.ticks),
            self.y.labels,
            strict=True,
        ):
            parts.append(line(window, [(left, y), (right, y)], color=PALE, width=1))
            at = (left - TICK_GAP, float(y))
            parts.append(
                text(window, label, at=at, height=TICK_HEIGHT, color=CONSOLE_GREY, anchor="right")
            )
        corners = [(left, top), (left, bottom), (right, bottom)]
        return [*parts, line(window, corners, color=CONSOLE_GREY, width=1.5)]


def decades(low: float, high: float) -> list[float]:
    """The powers of ten from one to the other."""
    exponents = range(round(np.log10(low)), round(np.log10(high)) + 1)
    return [10.0**exponent for exponent in exponents]


def line(
    window: Any, points: ArrayLike, *, color: str, width: float = 2, opacity: float = 1
) -> Any:
    """An open line through points in `height`; a width of 1 is 1/800 of the window's height."""
    from psychopy.visual.shape import BaseShapeStim

    return BaseShapeStim(
        window,
        vertices=np.asarray(points, dtype=np.float64),
        closeShape=False,
        fillColor=None,
        lineColor=color,
        lineWidth=width * window.size[1] / PIXELS,
        opacity=opacity,
        units="height",
        autoLog=False,
    )


def panel_card(window: Any, *, edges: tuple[float, float, float, float]) -> Any:
    """The white ground of one part of the page, from its left, bottom, right and top."""
    left, bottom, right, top = edges
    middle = ((left + right) / 2, (bottom + top) / 2)
    return card(window, box=(*middle, right - left, top - bottom), radius=0.012)


class CachedPicture:
    """What seldom changes, drawn once and then copied to each frame as a picture of it."""

    def __init__(self, window: Any, draw: Callable[[], None]) -> None:
        self._window, self._draw = window, draw
        self._picture: Any = None

    def renew(self) -> None:
        """Draw it again for the next frame."""
        self._picture = None

    def draw(self) -> None:
        """Draw it; first of all in a frame, since it covers the window."""
        from psychopy import visual

        if self._picture is None:
            self._draw()
            self._picture = visual.BufferImageStim(self._window, interpolate=False, autoLog=False)
        self._picture.draw()


class Marker:
    """A disc that can be filled, hollow or a hollow diamond."""

    def __init__(self, window: Any, *, color: str, radius: float = 0.011) -> None:
        from psychopy import visual

        self._color = color
        self._stimuli = {
            edges: visual.Circle(
                window,
                radius=radius,
                edges=edges,
                lineColor=color,
                lineWidth=2.5 * window.size[1] / PIXELS,
                fillColor=CARD,
                units="height",
                autoLog=False,
            )
            for edges in (4, 32)
        }
        self._filled = False

    def draw(self, at: Point, *, filled: bool, diamond: bool = False) -> None:
        """Draw it there."""
        stimulus = self._stimuli[4 if diamond else 32]
        if filled != self._filled:
            self._stimuli[32].fillColor = self._color if filled else CARD
            self._filled = filled
        stimulus.pos = at
        stimulus.draw()


class LiveText:
    """A text that is laid out again only where it has changed, which is what costs time."""

    def __init__(
        self,
        window: Any,
        *,
        at: Point,
        height: float = TICK_HEIGHT,
        color: str = INK,
        bold: bool = False,
        anchor: str = "left",
        wrap: float = 1.15,
    ) -> None:
        self._stimulus = text(
            window, "", at=at, height=height, color=color, bold=bold, anchor=anchor, wrap=wrap
        )
        self.content = ""

    def show(self, content: str) -> bool:
        """Show these words from now on; whether they are others than before."""
        changes = content != self.content
        if changes:
            self._stimulus.text = self.content = content
        return changes

    def draw(self, at: Point | None = None) -> None:
        """Draw it, there or where it was."""
        if at is not None:
            self._stimulus.pos = at
        if self.content:
            self._stimulus.draw()
