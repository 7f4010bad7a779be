"""Shows visits on a rig that only notes, and tells the test what happens.

Standard input: a line for each window, its width and height in pixels. While it is open, a line is
the path of a picture of the next frame, or "close" for the window's own button.
Standard output: one JSON object per line: {"asked": …} for what the rig is asked, {"frame": …} with
handles (pixels of the screen) and all words for the first frame and for each line, and {"ended": …}
with the places to which the pointer went.
"""

import json
import select
import sys

import numpy as np

from tactileq.experiments.feel import panels, window
from tactileq.experiments.feel.plots import LiveText
from tactileq.experiments.feel.rigs import HandNow, OutputNow
from tactileq.experiments.feel.textures import Texture
from tactileq.experiments.feel.view import FeltCriterion
from tactileq.experiments.feel.visit import Visit
from tactileq.modeling import Threshold, simplify
from tactileq.stimuli.planted.textures import planted_texture

live_texts = []
pointed = set()


def report(**what):
    print(json.dumps(what), flush=True)


class NotedText(LiveText):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        live_texts.append(self)


class NotingRig:
    notes = ("simulated hand", "force assumed")
    steps = 0
    faults = ()
    halted = False

    def present_model(self, model):
        report(asked=[model.texture, model.n_layers])

    def arm(self):
        pass

    def silence(self):
        self.faults = ("the tablet is gone.",)
        report(asked=["silence"])

    def mask(self, on):
        report(asked=["mask", on])

    def point(self, x, y, *, inside):
        if inside:
            pointed.add((x, y))

    def hand(self):
        self.steps += 1
        phase = 0.1 * self.steps
        speed, force = 200 * np.sin(phase), 1.5 + 0.5 * np.cos(phase)
        return HandNow(speed_mm_s=speed, force_n=force, force_assumed=True)

    def output(self):
        return OutputNow(rms_g=0.1, peak_g=0.4, limits=("peak",), misses=2, latency_s=0.005)

    def take_faults(self):
        told, self.faults = self.faults, ()
        return told


def on_frame(shown):
    global first
    if not (first or select.select([sys.stdin], [], [], 0)[0]):
        return
    wanted = "" if first else sys.stdin.readline().strip()
    first = False
    if wanted == "close":
        shown.window.winHandle.dispatch_event("on_close")
    elif wanted:
        shown.window.getMovieFrame(buffer="back")
        shown.window.saveMovieFrames(wanted)
    left, top = shown.window.winHandle.get_location()
    handles = {name: (left + x, top + y) for name, (x, y) in shown.handles().items()}
    report(frame=handles, words=[text.content for text in live_texts])


def visit_in(size):
    global first
    first = True
    live_texts.clear()
    pointed.clear()
    visit = Visit(textures, NotingRig())
    with window.FeelWindow(visit, yardstick, size=size, on_frame=on_frame) as shown:
        shown.run()
    report(ended=True, pointed=sorted(pointed))


window.LiveText = panels.LiveText = NotedText
threshold = Threshold.shipped("codec")
canvas, leather = planted_texture("canvas"), planted_texture("leather")
textures = [
    Texture(full=canvas, simplified=simplify(canvas, threshold, criterion="paper-fft").model)
]
textures.append(Texture(full=leather))
yardstick = FeltCriterion(threshold=threshold)
while order := sys.stdin.readline():
    visit_in(tuple(map(int, order.split())))
