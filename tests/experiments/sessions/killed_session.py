"""Runs a session whose process is killed by SIGKILL while the fourth trial is being answered."""

import os
import signal
import sys

from experiments import ModelSets, Study, run_absolute
from experiments.sessions.surfaces import Rating
from rig.twin import SimulatedRig
from stimuli.planted.textures import planted_texture


class Killed:
    simulated = True

    def announce(self, title, text):
        pass

    def confirm_mount(self, tray):
        pass

    def rate(self, trial, surfaces):
        if trial.trial == 4:
            os.kill(os.getpid(), signal.SIGKILL)
        return Rating(
            magnitude_similarity=10.0 * trial.trial, frequency_similarity=5.0, response_time_s=1.0
        )


study = Study.load()
truths = {texture: planted_texture(texture) for texture in study.textures}
fewer = {texture: truth.with_layers([0]) for texture, truth in truths.items()}
fewer = {texture: truth.with_layers([0]) for texture, truth in truths.items()}
run_absolute(
    study,
    subject=1,
    session=1,
    models=ModelSets(sets={"full": truths, "simplified": fewer}),
    rig=SimulatedRig(truths),
    respondent=Killed(),
    data_folder=sys.argv[1],
)
