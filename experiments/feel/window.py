"""The window for visitors: textures to switch between, and what the hand feels, live (PsychoPy).

The hand and the sound run in processes of their own, which never wait for a drawing.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from tactileq.experiments.console.drawing import BLUE, CONSOLE_GREY, CONSOLE_ORANGE, text
from tactileq.experiments.console.events import Mouse
from tactileq.experiments.console.page import Page
from tactileq.experiments.console.screens import open_window
from tactileq.experiments.console.widgets import Button
from tactileq.experiments.feel.panels import HandPanel, LayerPanel, Layout, SpectrumPlot, layout_for
from tactileq.experiments.feel.plots import TICK_HEIGHT, CachedPicture, LiveText, panel_card
from tactileq.experiments.feel.view import (
    HIGHEST_SHARE,
    PLACE_WORDS,
    FeltCriterion,
    ModelNow,
    Now,
    amplitude_range,
    hand_words,
    output_words,
    short,
    spectrum_range,
    texture_now,
)
from tactileq.experiments.feel.visit import Visit

FRAME_S = 1 / 40  # the drawing takes no more of the processor than it needs
POINTER_S = 0.005
WORDS_S = 0.1  # words that change faster cannot be read, and cost the most to draw
MOST_BUTTONS = 9
LONGEST_LABEL, LONGEST_TITLE, LONGEST_FAULT = 14, 18, 240  # characters
LEAD = "Stroke: the spectrum follows your hand. Filled layers can be felt, hollow ones cannot."
KEYS = (
    "1–9 or arrow keys: texture     F: full or simplified     Space: stop or play     "
    "M: masking noise     Esc: end"
)

# Called after each drawing, before it is shown.
FrameHook = Callable[["FeelWindow"], None]


class PointerPosition:
    """Where the pointer is on a window, in pixels from the bottom left."""

    def __init__(self, window: Any) -> None:
        self.at = (0.0, 0.0)
        self.inside = False
        window.winHandle.push_handlers(
            on_mouse_motion=lambda x, y, *_moved: self._move(x, y),
            on_mouse_drag=lambda x, y, *_moved: self._move(x, y),
            on_mouse_enter=self._move,
            on_mouse_leave=lambda _x, _y: self._leave(),
        )

    def _move(self, x: float, y: float) -> None:
        self.at, self.inside = (float(x), float(y)), True

    def _leave(self) -> None:
        self.inside = False


class FeelWindow:
    """Shows a visit until Escape is pressed or the window is closed.

    Parameters
    ----------
    yardstick : FeltCriterion
        By which a layer counts as felt.
    size : (int, int)
        Window in pixels, at least 4:3.
    screen : int
        Which screen, from 0; InputError where there is none.
    on_frame : callable, optional
        Called with each frame; lets a test press the right pixels and look.
    """

    def __init__(
        self,
        visit: Visit,
        yardstick: FeltCriterion,
        *,
        size: tuple[int, int] = (1280, 800),
        fullscreen: bool = False,
        screen: int = 0,
        on_frame: FrameHook | None = None,
    ) -> None:
        self._visit, self._yardstick = visit, yardstick
        self.window = open_window(size=size, fullscreen=fullscreen, screen=screen)
        self._mouse = Mouse(self.window)
        self._pointer = PointerPosition(self.window)
        self._on_frame = on_frame
        self._fault = ""
        self._ended = False
        self.window.winHandle.push_handlers(on_close=self._close_soon)
        self._words_due_s = 0.0
        width, height = self.window.winHandle.get_size()
        self._build(layout_for(width / height))

    def close(self) -> None:
        """Close the window."""
        self.window.close()

    def __enter__(self) -> FeelWindow:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self) -> None:
        """Play the first texture and show what is felt until the visitor ends it."""
        from psychopy import event

        event.clearEvents()
        self._draw()  # the first drawing may take longer than a rig plays unattended
        self.window.flip()  # which clears it: what comes next is not drawn over "stopped"
        self._visit.play()
        self._renew()
        while not self._ended:
            due = time.perf_counter() + FRAME_S
            self._draw()
            if self._on_frame is not None:
                self._on_frame(self)
            self.window.flip()
            for key in event.getKeys():
                if key == "escape":
                    return
                self._visit.press(key.removeprefix("num_"))
                self._renew()
            for kind, point in self._mouse.take():
                self._page.handle(kind, point)
                self._renew()
            self._follow_pointer(due)

    def _follow_pointer(self, until_s: float) -> None:
        """Pass the pointer's position to the rig, more often than a frame is drawn."""
        while True:
            self.window.winHandle.dispatch_events()
            self._visit.rig.point(*self._pointer.at, inside=self._pointer.inside)
            left_s = until_s - time.perf_counter()
            if left_s <= 0:
                return
            time.sleep(min(left_s, POINTER_S))

    def _close_soon(self) -> bool:
        """The window's own button: pyglet would close it in the middle of a frame."""
        self._ended = True
        return True

    def _renew(self) -> None:
        self._fault = ""
        self._words_due_s = 0.0
        self._ground.renew()

    def handles(self) -> dict[str, tuple[int, int]]:
        """The window's pixel (from the top left) of each button."""
        width, height = self.window.winHandle.get_size()
        return {
            name: (round(width / 2 + x * height), round(height / 2 - y * height))
            for name, (x, y) in self._page.handles().items()
        }

    # --- The page ---------------------------------------------------------------------------

    def _build(self, layout: Layout) -> None:
        textures = self._visit.textures
        highest = HIGHEST_SHARE * max(texture.full.rate_hz for texture in textures) / 2
        self._spectrum = SpectrumPlot(
            self.window, layout.spectrum, highest_hz=highest, density=spectrum_range(textures)
        )
        self._layers = LayerPanel(
            self.window,
            layout.layers,
            highest_hz=highest,
            amplitude=amplitude_range(self._yardstick, textures),
            yardstick=self._yardstick,
            most_layers=max(texture.full.n_layers for texture in textures),
        )
        self._hand = HandPanel(self.window, layout.hand, textures=textures)
        left = -layout.half + 0.02
        self._title = LiveText(self.window, at=(left, 0.455), height=0.042, bold=True)
        self._notes = LiveText(
            self.window,
            at=(left, 0.411),
            color=CONSOLE_ORANGE,
            bold=True,
            wrap=2 * layout.half - 0.04,
        )
        right = layout.half - 0.02
        lead = text(
            self.window,
            LEAD,
            at=(right, 0.44),
            height=TICK_HEIGHT,
            color=CONSOLE_GREY,
            wrap=0.42,
            anchor="right",
        )
        wrap = 2 * layout.half - 0.04
        self._foot = {
            color: LiveText(self.window, at=(0.0, -0.468), color=color, anchor="center", wrap=wrap)
            for color in (CONSOLE_GREY, CONSOLE_ORANGE)
        }
        x, top = layout.status[0] + 0.02, layout.status[3]
        self._status = [
            LiveText(self.window, at=(x, top - 0.027 - 0.031 * row)) for row in range(4)
        ]
        self._ground = CachedPicture(self.window, self._draw_ground)
        self._page = Page(
            "feel",
            widgets=[*self._texture_buttons(layout), *self._mode_buttons(layout)],
            decoration=[
                lead,
                panel_card(self.window, edges=layout.textures),
                panel_card(self.window, edges=layout.status),
                *self._spectrum.fixed(),
                *self._layers.fixed(),
                *self._hand.fixed(),
            ],
        )

    def _texture_buttons(self, layout: Layout) -> list[Button]:
        left, _, right, top = layout.textures
        width = (right - left - 0.05) / 2
        self._textures = []
        for index, texture in enumerate(self._visit.textures[:MOST_BUTTONS]):
            row, column = divmod(index, 2)
            at = (left + 0.02 + width / 2 + column * (width + 0.01), top - 0.036 - 0.044 * row)
            self._textures.append(
                Button(
                    self.window,
                    f"texture {index + 1}",
                    label=f"{index + 1}  {short(texture.name, LONGEST_LABEL)}",
                    at=at,
                    size=(width, 0.038),
                    action=partial(self._visit.choose, index),
                    height=TICK_HEIGHT,
                )
            )
        return self._textures

    def _mode_buttons(self, layout: Layout) -> list[Button]:
        left, bottom, right, _ = layout.textures
        width = (right - left - 0.07) / 4
        visit = self._visit
        wanted = [
            ("full", "Full", CONSOLE_GREY, lambda: visit.switch_model(simplified=False)),
            ("simplified", "Simplified", BLUE, lambda: visit.switch_model(simplified=True)),
            ("stop", "Stop", CONSOLE_ORANGE, visit.stop_or_play),
            ("noise", "Noise", BLUE, visit.switch_masking),
        ]
        self._modes = {
            name: Button(
                self.window,
                name,
                label=label,
                at=(left + 0.02 + width / 2 + column * (width + 0.01), bottom + 0.03),
                size=(width, 0.042),
                action=action,
                color=color,
                height=0.0165,
            )
            for column, (name, label, color, action) in enumerate(wanted)
        }
        return list(self._modes.values())

    def _draw_ground(self) -> None:
        """All that seldom changes."""
        self._page.draw()
        self._title.draw()
        self._notes.draw()
        for words in self._foot.values():
            words.draw()

    # --- A frame ----------------------------------------------------------------------------

    def _draw(self) -> None:
        visit = self._visit
        hand = visit.rig.hand()
        now = texture_now(visit.texture, hand, self._yardstick)
        model = visit.texture.model(simplified=visit.simplified)
        shown = now.simplified if model is not visit.texture.full else now.full
        shown = shown or now.full
        if time.perf_counter() >= self._words_due_s:
            self._words_due_s = time.perf_counter() + WORDS_S
            self._show_words(now, shown)
            self._hand.show_words(hand_words(hand), PLACE_WORDS[now.place])
        self._ground.draw()
        self._spectrum.draw(now, plays=shown if visit.playing else None)
        self._layers.draw(now, plays=shown)
        self._hand.draw(hand, now.place)
        for words in self._status:
            words.draw()

    def _show_words(self, now: Now, shown: ModelNow) -> None:
        """Bring words and buttons up to date."""
        visit = self._visit
        kind = "full model" if shown is now.full else "simplified model"
        name = short(visit.texture.name, LONGEST_TITLE)
        self._fault = (*visit.take_faults(), self._fault)[0]
        self._title.show(f"{name}, {kind}" + ("" if visit.playing else ": stopped"))
        simulated = ("simulated texture",) if visit.texture.full.simulated else ()
        changes = (
            self._notes.show(", ".join([*simulated, *visit.rig.notes])),
            self._foot[CONSOLE_GREY].show("" if self._fault else KEYS),
            self._foot[CONSOLE_ORANGE].show(short(self._fault, LONGEST_FAULT)),
        )
        if any(changes):
            self._ground.renew()
        self._spectrum.show_words(visit.texture)
        self._layers.show_words(shown)
        self._hand.choose(visit.texture)
        words = output_words(visit.rig.output(), shown, playing=visit.playing)
        for place, content in zip(self._status, (*words, ""), strict=False):
            place.show(content)
        for index, button in enumerate(self._textures):
            button.lit = index == visit.chosen
        self._modes["full"].lit = kind == "full model"
        self._modes["simplified"].lit = kind == "simplified model"
        simplified = visit.texture.simplified
        self._modes["simplified"].needs = "" if simplified is not None else "a simplified model"
        self._modes["stop"].lit = not visit.playing
        self._modes["noise"].lit = visit.masked
