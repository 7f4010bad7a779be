"""Runs one session at the console on a simulated rig, and tells the test what happens.

Standard output: one JSON object per line, {"page": …, "handles": …}, {"presented": …} or
{"result": …}, with every text drawn so far. Standard input: a line presses the rig's button.
"""

import json
import select
import sys

from psychopy import visual

from experiments import ModelSets, Study, run_absolute, run_relative
from experiments.console.console import Console
from rig.twin import SimulatedRig
from stimuli.planted.textures import planted_texture

task, folder = sys.argv[1:]
texts = []


def tell(**what):
    print(json.dumps(what), flush=True)


class NotedText(visual.TextStim):
    def __init__(self, window, **options):
        texts.append(options["text"])
        super().__init__(window, **options)


class TellingRig(SimulatedRig):
    def present_model(self, model):
        left_s = super().present_model(model)
        tell(presented=["virtual", model.texture])
        return left_s

    def present_real(self, texture):
        self.silence()
        tell(presented=["real", texture])
        return self.now_s()

    def read(self):
        if select.select([sys.stdin], [], [], 0)[0] and sys.stdin.readline():
            self.press_button()
        reading = super().read()
        if self.last_vibration.any():
            vibrated.append(True)
        return reading


visual.TextStim = NotedText
vibrated = []
study = Study.load()
truths = {texture: planted_texture(texture) for texture in study.textures}
fewer = {texture: truth.with_layers([0]) for texture, truth in truths.items()}
run = {"absolute": run_absolute, "relative": run_relative}[task]
with Console(
    size=(1280, 800),
    on_page=lambda page, handles: tell(page=page, handles=handles, texts=texts),
) as console:
    result = run(
        study,
        subject=1,
        session=1,
        models=ModelSets(sets={"full": truths, "simplified": fewer}),
        rig=TellingRig(truths),
        respondent=console,
        data_folder=folder,
    )
tell(result=[str(result.path), result.answered], vibrated=bool(vibrated))
