"""The parts of the window for visitors, each of which draws one part of the view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from tactileq.experiments.console.drawing import BLUE, CONSOLE_GREY, CONSOLE_ORANGE, INK, text
from tactileq.experiments.feel.plots import (
    PIXELS,
    TICK_HEIGHT,
    Axes,
    LiveText,
    Marker,
    Scale,
    decades,
    line,
    panel_card,
)
from tactileq.experiments.feel.rigs import HandNow
from tactileq.experiments.feel.textures import Texture
from tactileq.experiments.feel.view import (
    FeltCriterion,
    FeltLayers,
    ModelNow,
    Now,
    Place,
    felt_words,
    level_words,
    short,
)
from tactileq.modeling.errors import counted

Box = tuple[float, float, float, float]

GREEN = "#009E73"  # Okabe and Ito's
PURPLE = "#CC79A7"
HEADING_HEIGHT = 0.024
FREQUENCY_TICKS_HZ = (10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
TRAIL = 24  # positions of the hand that are kept
TRAIL_PARTS = 4


# Legend of the markers: distance from the right edge, meaning, filled?, a diamond?
MARKERS = (
    (0.295, "felt", True, False),
    (0.23, "not felt", False, False),
    (0.13, "unknown", False, True),
)


class Drawn(NamedTuple):
    """A marker in its place."""

    marker: Marker
    at: tuple[float, float]
    filled: bool
    diamond: bool

    def draw(self) -> None:
        """Draw it."""
        self.marker.draw(self.at, filled=self.filled, diamond=self.diamond)


class Layout(NamedTuple):
    """Boxes (left, bottom, right, top) of the page's parts, in `height`, and its half width."""

    half: float
    spectrum: Box
    layers: Box
    textures: Box
    hand: Box
    status: Box


def layout_for(aspect: float) -> Layout:
    """The page for a window of this width over height; at most 16:9 of it are used."""
    half = float(np.clip(aspect, 4 / 3, 16 / 9)) / 2
    left, right = -half + 0.02, half - 0.02
    middle = right - 0.42
    return Layout(
        half,
        spectrum=(left, 0.0, middle - 0.015, 0.385),
        layers=(left, -0.435, middle - 0.015, -0.015),
        textures=(middle, 0.075, right, 0.385),
        hand=(middle, -0.275, right, 0.06),
        status=(middle, -0.435, right, -0.29),
    )


def frequency_scale(highest_hz: float) -> Scale:
    """The axis of frequencies, 10 Hz to the highest."""
    ticks = [f for f in FREQUENCY_TICKS_HZ if f < highest_hz]
    return Scale(
        ends=(10.0, highest_hz),
        kind="log",
        ticks=ticks,
        labels=[f"{f / 1000:g} kHz" if f >= 1000 else f"{f:g}" for f in ticks],
    )


def level_scale(low: float, high: float) -> Scale:
    """A logarithmic axis of levels with a tick at each decade."""
    ticks = decades(low, high)
    return Scale(ends=(low, high), kind="log", ticks=ticks, labels=[f"{tick:g}" for tick in ticks])


def density_scale(low: float, high: float) -> Scale:
    """As `level_scale` for densities (g/√Hz), labelled in dB re 1 g²/Hz."""
    ticks = decades(low, high)
    labels = [f"{20 * np.log10(tick):.0f}" for tick in ticks]
    return Scale(ends=(low, high), kind="log", ticks=ticks, labels=labels)


class SpectrumPlot:
    """Spectra of the full and of the simplified model at the hand's speed and force."""

    def __init__(
        self, window: Any, box: Box, *, highest_hz: float, density: tuple[float, float]
    ) -> None:
        left, bottom, right, top = box
        self._axes = Axes(
            box=(left + 0.085, bottom + 0.045, right - 0.03, top - 0.085),
            x=frequency_scale(highest_hz),
            y=density_scale(*density),
        )
        heading = "Playing: spectrum at this speed and force (dB re 1 g²/Hz)"
        at = (left + 0.02, top - 0.026)
        self._fixed = [
            panel_card(window, edges=box),
            text(window, heading, at=at, height=HEADING_HEIGHT, bold=True, anchor="left"),
            *self._axes.decoration(window),
            line(
                window, [(left + 0.09, top - 0.06), (left + 0.13, top - 0.06)], color=CONSOLE_GREY
            ),
            line(window, [(left + 0.34, top - 0.06), (left + 0.38, top - 0.06)], color=BLUE),
        ]
        self._legend = [
            LiveText(window, at=(left + at_x, top - 0.06), color=color)
            for at_x, color in ((0.14, CONSOLE_GREY), (0.39, BLUE))
        ]
        self._scale = window.size[1] / PIXELS
        start = self._axes.points([10.0, highest_hz], density[0])
        self._curves = [line(window, start, color=color) for color in (CONSOLE_GREY, BLUE)]

    def fixed(self) -> list[Any]:
        """What changes with the texture alone."""
        return [*self._fixed, *self._legend]

    def show_words(self, texture: Texture) -> None:
        """Name what is drawn."""
        fewer = texture.simplified
        self._legend[0].show(f"full model, {counted(texture.full.n_layers, 'layer')}")
        self._legend[1].show(
            "no simplified model"
            if fewer is None
            else f"simplified model, {counted(fewer.n_layers, 'layer')}"
        )

    def draw(self, now: Now, *, plays: ModelNow | None) -> None:
        """Both curves; the model that plays has the thick one."""
        for curve, model in zip(self._curves, (now.full, now.simplified), strict=True):
            if model is None:
                continue
            curve.vertices = self._axes.points(model.frequency_hz, model.density)
            curve.lineWidth = (5 if model is plays else 2) * self._scale
            curve.draw()


class LayerPanel:
    """Each layer against the detection threshold: felt ones filled, others hollow."""

    def __init__(
        self,
        window: Any,
        box: Box,
        *,
        highest_hz: float,
        amplitude: tuple[float, float],
        yardstick: FeltCriterion,
        most_layers: int,
    ) -> None:
        left, bottom, right, top = box
        self._axes = Axes(
            box=(left + 0.085, bottom + 0.06, right - 0.03, top - 0.095),
            x=frequency_scale(highest_hz),
            y=level_scale(*amplitude),
        )
        self._floor = amplitude[0]
        self._fixed = [
            panel_card(window, edges=box),
            *self._axes.decoration(window),
            *self._threshold(window, yardstick, highest_hz=highest_hz),
            *self._legend(window, box, yardstick),
        ]
        self._heading = LiveText(
            window, at=(left + 0.02, top - 0.026), height=HEADING_HEIGHT, bold=True
        )
        foot = self._axes.points([10.0, 10.0], self._floor)
        self._stems = [
            [line(window, foot, color=color, width=width) for _ in range(most_layers)]
            for color, width in ((CONSOLE_GREY, 2), (BLUE, 4))
        ]
        self._markers = [Marker(window, color=color) for color in (CONSOLE_GREY, BLUE)]
        self._labels = [
            LiveText(window, at=(0.0, 0.0), anchor="center", bold=True) for _ in range(most_layers)
        ]

    def fixed(self) -> list[Any]:
        """What never changes."""
        return self._fixed

    def _threshold(self, window: Any, yardstick: FeltCriterion, *, highest_hz: float) -> list[Any]:
        threshold = yardstick.threshold
        end, last = threshold.valid_range_hz[1], float(threshold.acceleration_g[-1])
        known = threshold.frequency_hz <= highest_hz
        points = self._axes.points(threshold.frequency_hz[known], threshold.acceleration_g[known])
        parts = [line(window, points, color=INK, width=3)]
        if yardstick.hold_above and end < highest_hz:
            dashes = np.geomspace(end, highest_hz, 24)
            for low, high in zip(dashes[::2], dashes[1::2], strict=True):
                held = self._axes.points([low, high], last)
                parts.append(line(window, held, color=PURPLE, width=3))
        return parts

    def _legend(self, window: Any, box: Box, yardstick: FeltCriterion) -> list[Any]:
        left, bottom, right, top = box
        y = top - 0.066
        entries = [(0.09, INK, f"threshold ({short(yardstick.threshold.name, 9)})")]
        if yardstick.hold_above:
            entries.append((0.31, PURPLE, "assumed above"))
        parts = []
        for at_x, color, words in entries:
            x = left + at_x
            parts.append(line(window, [(x, y), (x + 0.035, y)], color=color, width=3))
            parts.append(text(window, words, at=(x + 0.043, y), height=TICK_HEIGHT, anchor="left"))
        for at_x, words, filled, diamond in MARKERS:
            x = right - at_x
            parts.append(Drawn(Marker(window, color=INK, radius=0.008), (x, y), filled, diamond))
            parts.append(text(window, words, at=(x + 0.015, y), height=TICK_HEIGHT, anchor="left"))
        below = (0.5 * (left + right) + 0.03, bottom + 0.017)
        parts.append(
            text(window, "frequency (Hz)", at=below, height=TICK_HEIGHT, color=CONSOLE_GREY)
        )
        return parts

    def show_words(self, plays: ModelNow) -> None:
        """Say how many layers are felt, and the level of each."""
        layers = plays.layers
        self._heading.show(f"Layers felt: {felt_words(layers)} (g peak; dB: above threshold)")
        for label, level in zip(self._labels, layers.sensation_db, strict=False):
            label.show(level_words(float(level)))

    def draw(self, now: Now, *, plays: ModelNow) -> None:
        """Stems and markers, and the levels of the model that plays."""
        self._heading.draw()
        for index, model in enumerate((now.full, now.simplified)):
            if model is not None and (model is plays or index == 0):
                self._draw_layers(model.layers, index)
        for label, at in zip(self._labels, self._tops(plays.layers), strict=False):
            label.draw((float(at[0]), float(at[1]) + 0.026))

    def _tops(self, layers: FeltLayers) -> Any:
        return self._axes.points(layers.frequency_hz, np.maximum(layers.amplitude_g, self._floor))

    def _draw_layers(self, layers: FeltLayers, index: int) -> None:
        bottom = self._axes.box[1]
        shown = zip(
            self._stems[index],
            self._tops(layers).tolist(),
            layers.felt.tolist(),
            layers.unknown.tolist(),
            strict=False,
        )
        for stem, (x, y), felt, unknown in shown:
            stem.vertices = [(x, bottom), (x, y)]
            stem.draw()
            self._markers[index].draw((x, y), filled=felt, diamond=unknown)


class HandPanel:
    """Speed and force of the hand on the grid of the model, with where it has just been."""

    def __init__(self, window: Any, box: Box, *, textures: Sequence[Texture]) -> None:
        left, bottom, right, top = box
        fastest = max(float(texture.full.speeds_mm_s[-1]) for texture in textures)
        strongest = max(float(texture.full.forces_n[-1]) for texture in textures)
        self._axes = Axes(
            box=(left + 0.06, bottom + 0.07, right - 0.02, top - 0.085),
            x=_linear(1.3 * fastest),
            y=_linear(1.3 * strongest),
        )
        self._fixed = [
            panel_card(window, edges=box),
            text(
                window,
                "Hand: force (N), speed (mm/s)",
                at=(left + 0.02, top - 0.026),
                height=HEADING_HEIGHT,
                bold=True,
                anchor="left",
            ),
            *self._axes.decoration(window),
        ]
        self._words = LiveText(window, at=(left + 0.06, top - 0.06), bold=True)
        self._place = LiveText(window, at=(left + 0.02, bottom + 0.02))
        self._grid = [line(window, self._axes.points([0, 1], 0), color=BLUE)]
        self._trail = [
            line(window, self._axes.points([0, 0], 0), color=GREEN, width=3, opacity=opacity)
            for opacity in np.linspace(0.15, 0.9, TRAIL_PARTS)
        ]
        self._dots = {
            inside: Marker(window, color=GREEN if inside else CONSOLE_ORANGE, radius=0.013)
            for inside in (True, False)
        }
        self._been = np.empty((0, 2))

    def fixed(self) -> list[Any]:
        """What never changes."""
        return [*self._fixed, *self._grid]

    def choose(self, texture: Texture) -> None:
        """Draw the edge of this texture's grid."""
        speeds, forces = texture.full.speeds_mm_s, texture.full.forces_n
        x = [speeds[0], speeds[-1], speeds[-1], speeds[0], speeds[0]]
        y = [forces[0], forces[0], forces[-1], forces[-1], forces[0]]
        self._grid[0].vertices = self._axes.points(x, y)

    def show_words(self, words: str, place: str) -> None:
        """Say where the hand is."""
        self._words.show(words)
        self._place.show(place)

    def draw(self, hand: HandNow, place: Place) -> None:
        """The hand as a dot: filled on the grid, hollow outside."""
        speed = abs(hand.speed_mm_s) if hand.there else 0.0
        at = self._axes.points([speed], [max(hand.force_n, 0.0) if hand.there else 0.0])[0]
        before = self._been if len(self._been) else np.tile(at, (TRAIL, 1))
        self._been = np.concatenate([before[1:], [at]])
        step = TRAIL // TRAIL_PARTS
        for part, stimulus in enumerate(self._trail):
            stimulus.vertices = self._been[part * step : (part + 1) * step + 1]
            stimulus.draw()
        inside = place == "inside"
        self._dots[inside].draw((float(at[0]), float(at[1])), filled=inside)
        self._words.draw()
        self._place.draw()


def _linear(end: float) -> Scale:
    step = next(s for s in (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if end / s <= 6)
    ticks = np.arange(0, end, step).tolist()
    return Scale(ends=(0, end), kind="linear", ticks=ticks, labels=[f"{t:g}" for t in ticks])
