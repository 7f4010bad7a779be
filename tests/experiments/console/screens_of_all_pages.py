"""Shows every page of the console and tells where everything on it is.

    python screens_of_all_pages.py FOLDER LANGUAGE:WIDTHxHEIGHT ...

Standard output: one JSON object per page, {"screen": "en:1024x768", "page": …,
"texts": [[words, box]], "shapes": [box], "fills": [color] of the shapes, "places": [[x, y]] of the
texts, "colors": [[color, that of what is behind it]] of the texts}; boxes are (left, bottom, right,
top), all in pixels from the window's middle. Each page is
kept in the folder as a picture; for the folder "-", none is.
"""

import json
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from psychopy import visual
from pyglet import gl
from pyglet.window import key

from tactileq.experiments.console import page_runner
from tactileq.experiments.console.console import Console
from tactileq.experiments.console.drawing import HALF_RISE, PAPER
from tactileq.experiments.console.languages import Texts
from tactileq.experiments.sessions.loop.people import Intake, SessionAborted
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.study.questions import MOST_LEVELS, Question
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks.absolute import AbsoluteTrial
from tactileq.experiments.tasks.oddity import OddityTrial
from tactileq.experiments.tasks.relative import RelativeTrial
from tactileq.experiments.tasks.threshold import ThresholdTrial
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.rig.shared.interface import ToneBurst
from tactileq.stimuli.planted.textures import planted_texture

drawn = []


def noted(kind):
    draw = kind.draw

    def note(stimulus, *given, **options):
        draw(stimulus, *given, **options)
        drawn.append(stimulus)

    kind.draw = note


noted(visual.TextStim)
noted(visual.shape.BaseShapeStim)
noted(visual.ShapeStim)  # buttons and cards, which it draws in a way of its own


def text_box(stimulus):
    (x, y), (width, height) = stimulus.posPix, stimulus.boundingBox
    if spacing := stimulus._pygletTextObj.get_style("line_spacing"):
        y -= round(spacing / 2 - HALF_RISE * stimulus._heightPix)  # the empty part above the lines
    left = x - {"left": 0, "center": 0.5, "right": 1}[stimulus.anchorHoriz] * width
    return [float(v) for v in (left, y - height / 2, left + width, y + height / 2)]


def shape_box(stimulus):
    corners = stimulus.verticesPix
    return [float(v) for v in (*corners.min(axis=0), *corners.max(axis=0))]


def hex_of(color):
    return "#" + color.hex.strip("#").upper()


def behind(stimulus):
    """The colour on which a text stands: that of the shape around it that was drawn last."""
    left, bottom, right, top = text_box(stimulus)
    color = PAPER
    for shape in drawn[: drawn.index(stimulus)]:
        if isinstance(shape, visual.shape.BaseShapeStim) and shape.fillColor is not None:
            box = shape_box(shape)
            if box[0] <= left and box[1] <= bottom and right <= box[2] and top <= box[3]:
                color = hex_of(shape._fillColor)
    return color


class Visitor:
    """Presses and looks, as the steps for a page say: one step a frame."""

    def __init__(self, screen, folder):
        self.screen, self.folder = screen, folder
        self.plan, self.handles, self.wanted, self.steps = {}, {}, None, iter(())

    def sit_down(self, window):
        self.window, self._flip = window, window.flip
        window.flip = self.flip
        if self.folder is None:
            # Everything is drawn but for the pixels, which nobody sees.
            gl.glEnable(gl.GL_RASTERIZER_DISCARD)
            window.winHandle.flip = lambda: None

    def on_page(self, page, handles):
        self.handles = handles
        self.steps = self.go(self.plan[page])

    def flip(self):
        if self.wanted is not None:
            self.tell(self.wanted)
            self.wanted = None
        drawn.clear()
        self._flip()
        next(self.steps, None)

    def tell(self, name):
        texts = [[s.text, text_box(s)] for s in drawn if isinstance(s, visual.TextStim) and s.text]
        shapes = [s for s in drawn if isinstance(s, visual.shape.BaseShapeStim)]
        places = [
            [float(v) for v in s.posPix] for s in drawn if isinstance(s, visual.TextStim) and s.text
        ]
        told = {"screen": self.screen, "page": name, "texts": texts, "places": places}
        told["shapes"] = [shape_box(s) for s in shapes]
        told["fills"] = [hex_of(s._fillColor) for s in shapes]
        told["colors"] = [
            [hex_of(s._foreColor), behind(s)]
            for s in drawn
            if isinstance(s, visual.TextStim) and s.text
        ]
        print(json.dumps(told), flush=True)
        if self.folder is not None:
            self.window.getMovieFrame(buffer="back")
            name = f"{name} {self.screen.replace(':', ' ')}.png"
            self.window.saveMovieFrames(str(self.folder / name))

    def go(self, steps):
        for step in steps:
            verb, _, what = step.partition(" ")
            getattr(self, verb)(what)
            yield

    def look(self, name):
        self.wanted = name

    def press(self, handle):
        x, y = self.handles[handle]
        y = self.window.winHandle.get_size()[1] - y
        self.window.winHandle.dispatch_event("on_mouse_press", x, y, 1, 0)
        self.window.winHandle.dispatch_event("on_mouse_release", x, y, 1, 0)

    def key(self, name):
        self.window.winHandle.dispatch_event("on_key_press", getattr(key, name), 0)


def surfaces_of(count, *, feel_all=False, real=True):
    rig = SimulatedRig()
    rig.open()
    return Surfaces(
        rig,
        texture="canvas",
        models=[planted_texture("canvas")] * count,
        begin=Surfaces.present_real if real else Surfaces.present_virtual,
        note=lambda event, **fields: None,
        feel_all=feel_all,
    )


def intervals():
    burst = ToneBurst(frequency_hz=100.0, amplitude_g=0.1, duration_s=0.5)
    return Surfaces(
        SimulatedRig(),
        texture="",
        models=[burst, burst],
        begin=lambda of: None,
        note=lambda event, **fields: None,
        feel_all=True,
    )


def ask_everything(console, visitor):
    questions = (*Study.load().questions, OWN)
    visitor.plan = {
        "consent": ["key TAB", "look consent", "press yes"],
        "code": ["look code", "press continue"],
        "known": ["look known", "press yes"],
        "question age": [
            *("press digit 1", "press digit 7", "look question-age-below", "press delete"),
            *("press decline", "look question-age-declined", "press digit 2", "press digit 5"),
            *("look question-age", "press digit 9", "look question-age-above", "press delete"),
            "press continue",
        ],
        **{
            f"question {question.name}": [
                *("key ENTER", f"look question-{question.name}-needed"),
                f"press level {question.levels[1]}",
                f"look question-{question.name}",
                "press continue",
            ]
            for question in questions
            if question.levels
        },
    }
    new = Intake(consent="2026-11", code="TAKI-46", known=False, questions=questions)
    console.consents("2026-11")
    console.welcome(new)
    console.welcome(Intake(consent="", code="TAKI-46", known=True, questions=questions))
    visitor.plan = {"consent": ["key ESCAPE"], "stop": ["look stop-first", "press stop now"]}
    with suppress(SessionAborted):
        console.consents("2026-11")


def announce_everything(console, visitor, texts):
    asked = ("consent", "code", "known", "wait", "stopping")
    pages = [k.removesuffix(".title") for k in texts.by_key if k.endswith(".title")]
    for page in pages:
        if page not in asked:
            visitor.plan = {page: [f"look {page}", "press continue"]}
            console.announce(page, **({"percent": 64} if page.startswith("strokes") else {}))


def try_everything(console, visitor):
    console.progress(12, 28)
    visitor.plan = {
        "rate": [
            *("look rate", "key ENTER", "look rate-needed", "key TAB", "look rate-focus"),
            *("press virtual", "press magnitude:50", "press frequency:100", "key TAB"),
            *("look rate-done", "press continue"),
        ]
    }
    console.rate(ABSOLUTE, surfaces_of(1))
    visitor.plan = {"rate": ["look rate-practice", "key ESCAPE"], "stop": ["press stop now"]}
    with suppress(SessionAborted):
        console.rate(replace(ABSOLUTE, phase="training"), surfaces_of(1))
    visitor.plan["choose"] = ["look choose-7-practice", "key ESCAPE"]
    with suppress(SessionAborted):
        console.choose(replace(RELATIVE, phase="training"), surfaces_of(7))
    visitor.plan = {
        "choose": [
            *("look choose-7", "press answer 2", "look choose-7-unfelt"),
            *("press button 2", "press answer 2", "press button 5"),
            *("look choose-7-chosen", "press continue"),
        ]
    }
    console.choose(RELATIVE, surfaces_of(7))
    visitor.plan = {"choose": ["press button 9", "look choose-12-all", "key ESCAPE"]}
    visitor.plan["stop"] = [
        *("look stop", "press reason time", "key TAB", "look stop-reason", "press stop now"),
    ]
    with suppress(SessionAborted):
        console.choose(RELATIVE, surfaces_of(12, feel_all=True))
    buttons = [f"press button {number}" for number in (1, 2, 3)]
    visitor.plan = {
        "choose": [
            "look choose-odd",
            *buttons,
            "press answer 3",
            "look choose-odd-all",
            "press continue",
        ]
    }
    console.choose(ODDITY, surfaces_of(3, feel_all=True, real=False))
    visitor.plan = {
        "choose": [
            *("look choose-interval", "press button 1", "look choose-interval-first"),
            *("press button 1", "look choose-interval-again"),
            *("press button 2", "look choose-interval-second", "press answer 1"),
            *("look choose-interval-chosen", "press continue"),
        ]
    }
    console.choose(THRESHOLD, intervals())
    visitor.plan = {"wait": ["look wait"]}
    ended = iter([False] * 6 + [True])
    console.wait(lambda: next(ended))


TRIAL = {"trial": 1, "phase": "main", "texture": "canvas", "model": "full", "tray": "A"}
ABSOLUTE = AbsoluteTrial(**TRIAL, virtual_texture="canvas", first_surface="real")
RELATIVE = RelativeTrial(**TRIAL, layout=("canvas",) * 7)
ODDITY = OddityTrial(**TRIAL, layout=("full", "full", "simplified"), odd_position=3)
THRESHOLD = ThresholdTrial(
    **{**TRIAL, "texture": "", "model": "", "tray": ""},
    frequency_hz=100.0,
    interval=1,
    amplitude_g=0.1,
    highest_g=1.0,
)
HOURS = range(0, 10 * MOST_LEVELS, 10)
OWN = Question(
    name="crafts",
    levels=tuple(f"{hours} to {hours + 9} hours in each week" for hours in HOURS),
    text={
        "en": "How many hours a week have you worked with textiles, wood or metal over the last "
        "twelve months?",
        "de": "Wie viele Stunden pro Woche haben Sie in den letzten zwölf Monaten mit Textilien, "
        "Holz oder Metall gearbeitet?",
        "ja": "この一年間、一週間に平均して何時間くらい、布や木や金属を手で扱う仕事をしましたか",
    },
    levels_text={
        "de": tuple(f"{hours} bis {hours + 9} Stunden in jeder Woche" for hours in HOURS),
        "ja": tuple(f"一週間に{hours}時間から{hours + 9}時間まで" for hours in HOURS),
    },
)


def look_at_all(screen, folder):
    language, _, size = screen.partition(":")
    width, height = map(int, size.split("x"))
    texts = Texts.load(language)
    visitor = Visitor(screen, folder)
    with Console(
        texts=texts,
        stamp="pilot, simulated rig",
        size=(width, height),
        on_page=visitor.on_page,
    ) as console:
        visitor.sit_down(console._window)
        ask_everything(console, visitor)
        announce_everything(console, visitor, texts)
        try_everything(console, visitor)


page_runner.FRAME_PAUSE_S = 0.0
folder, *screens = sys.argv[1:]
for screen in screens:
    look_at_all(screen, None if folder == "-" else Path(folder))
