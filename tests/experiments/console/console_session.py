"""Shows short sessions at the console on a simulated rig, and tells the test what happens.

    python console_session.py

Standard input: one JSON object per session, {"language": …, "parts": [part, …], "done": whether
there were trials before}, of the parts
"known" and "new" (welcome), "wait", "absolute", "relative", "oddity", "rest", "training" and
"closing"; or {"screens": [number, …]} to open a console on each. During a session a line presses
the rig's button; while the participant waits, it ends the wait, and "stop" ends it as an
experimenter does. One process shows them all: PsychoPy takes seconds to start.
Standard output: one JSON object per line, {"page": …, "handles": …}, {"presented": …, "after_ms":
since the frame that was shown last, "shown": the words in it}, {"silent": …}, {"noted": …}, or
{"result": …}.
"""

import json
import select
import sys
import time

from psychopy import visual

from tactileq.experiments.console.console import Console
from tactileq.experiments.console.languages import Texts
from tactileq.experiments.sessions.loop.people import Intake, SessionAborted
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.study.questions import Question
from tactileq.experiments.tasks.absolute import AbsoluteTrial
from tactileq.experiments.tasks.oddity import OddityTrial
from tactileq.experiments.tasks.relative import RelativeTrial
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.stimuli.planted.textures import planted_texture

QUESTIONS = (
    Question(name="age", least=18, most=99),
    Question(name="handedness", levels=("right", "left", "both")),
)
TRIAL = {"trial": 1, "phase": "main", "texture": "canvas", "model": "full", "tray": "A"}
ABSOLUTE = AbsoluteTrial(**TRIAL, virtual_texture="canvas", first_surface="virtual")
RELATIVE = RelativeTrial(**TRIAL, layout=("canvas", "MDF", "PVC"))
ODDITY = OddityTrial(**TRIAL, layout=("full", "simplified", "full"), odd_position=2)


def tell(**what):
    print(json.dumps(what), flush=True)


def line():
    return sys.stdin.readline().strip() if select.select([sys.stdin], [], [], 0)[0] else ""


class Frames:
    """When the last frame was shown, and which words it held."""

    def __init__(self):
        self.words, self.shown, self.at_s = [], [], 0.0
        draw = visual.TextStim.draw

        def noted(stimulus, *given, **options):
            self.words.append(stimulus.text)
            return draw(stimulus, *given, **options)

        visual.TextStim.draw = noted

    def watch(self, window):
        self.words, self.shown, self.at_s = [], [], 0.0
        self._swap, window.backend.swapBuffers = window.backend.swapBuffers, self.swap

    def swap(self, *given, **options):
        self._swap(*given, **options)
        self.at_s, self.shown, self.words = time.perf_counter(), self.words, []


class TellingRig(SimulatedRig):
    def present_model(self, model):
        self.tell("virtual")
        return super().present_model(model)

    def present_real(self, texture):
        self.tell("real")
        return super().present_real(texture)

    def tell(self, surface):
        after_ms = round(1e3 * (time.perf_counter() - frames.at_s), 2)
        tell(presented=surface, after_ms=after_ms, shown=frames.shown)

    def silence(self):
        tell(silent=True)
        super().silence()

    def read(self):
        if line():
            self.press_button()
        return super().read()


def ready():
    said = line()
    if said == "stop":
        raise SessionAborted("the rig is broken", by="experimenter")
    return bool(said)


def surfaces_of(count, begin, *, feel_all=False):
    rig = TellingRig()
    rig.open()
    return Surfaces(
        rig,
        texture="canvas",
        models=[planted_texture("canvas")] * count,
        begin=begin,
        note=lambda event, **fields: tell(noted=event, **fields),
        feel_all=feel_all,
    )


def run(console, part):
    if part in ("known", "new"):
        known = part == "known"
        if not known and not console.consents("2026-11"):
            return "consent refused"
        return console.welcome(
            Intake(consent="2026-11", code="TAKI-46", known=known, questions=QUESTIONS)
        )
    if part == "absolute":
        rating = console.rate(ABSOLUTE, surfaces_of(1, Surfaces.present_virtual))
        return [rating.magnitude_similarity, rating.frequency_similarity, rating.response_time_s]
    if part == "relative":
        return console.choose(RELATIVE, surfaces_of(3, Surfaces.present_real)).button
    if part == "oddity":
        surfaces = surfaces_of(3, Surfaces.present_virtual, feel_all=True)
        return console.choose(ODDITY, surfaces).button
    if part == "wait":
        return console.wait(ready)
    return console.rest() if part == "rest" else console.announce(f"absolute.{part}")


def hold(language, parts, *, done):
    with Console(
        texts=Texts.load(language),
        stamp="pilot",
        on_page=lambda page, handles: tell(page=page, handles=handles, shown=frames.shown),
    ) as console:
        frames.watch(console._window)
        console.hear(
            lambda event, **fields: tell(noted=event, **fields), lambda page: tell(followed=page)
        )
        if done:
            console.progress(12, 28)
        try:
            result = [run(console, part) for part in parts]
        except SessionAborted as aborted:
            result = [aborted.reason, aborted.by]
    tell(result=result)


def open_on(screen):
    try:
        with Console(screen=screen, size=(2000, 1500)) as console:
            return [int(pixels) for pixels in console._window.winHandle.get_size()]
    except ValueError as refusal:
        return str(refusal)


frames = Frames()
while order := sys.stdin.readline():
    asked = json.loads(order)
    if "screens" in asked:
        tell(result=[open_on(screen) for screen in asked["screens"]])
    else:
        hold(asked["language"], asked["parts"], done=asked["done"])
