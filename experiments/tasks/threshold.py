"""The detection threshold (docs/method/protocols.md#detection-threshold): ours, for `simplify`.

The pen is held still. Two intervals, a button each, are felt once; one of them holds a tone, the
other nothing. Which one? The tone's amplitude follows the answers (QUEST+), for each of eight
frequencies on its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log10
from typing import Any

from tactileq.experiments.sessions.loop.people import Respondent
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import Occasion, Order, Trial, fisher_yates
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.tasks.threshold_posterior import LEVELS_DB, answers_of, next_level_db
from tactileq.rig.shared.interface import TextureRig, ToneBurst

# --- Parameters -----------------------------------------------------------------------------

DESCRIPTION = (
    "Two-interval forced choice: the pen is held still, one of two intervals holds a tone of some "
    "frequency, and the participant says which one. The amplitude adapts to the answers (QUEST+)."
)
# An octave to two thirds of one apart: on lines between them the shipped thresholds are met within
# 1 dB RMS.
FREQUENCIES_HZ = (20.0, 40.0, 80.0, 160.0, 250.0, 400.0, 630.0, 1000.0)
DURATION_S = 0.7  # 14 periods of the lowest
# For practice, well felt: 16 dB and more above the shipped thresholds.
PRACTICE_HZ = (80.0, 160.0, 250.0)
PRACTICE_LEVEL_DB = -10.0
NONE = "n/a"  # instead of a texture and of a model


@dataclass(frozen=True, kw_only=True)
class ThresholdTrial(Trial):
    """One trial: two intervals, one of which holds a tone.

    Parameters
    ----------
    trial, phase, texture, model, tray
        As in `Trial`; texture and model are "n/a".
    interval : int
        That of the tone, 1 or 2: the right answer.
    amplitude_g, highest_g : float, optional
        Peak of the tone, and the highest that the rig can present; None before it is presented.
    """

    frequency_hz: float
    interval: int
    amplitude_g: float | None = None
    highest_g: float | None = None

    @property
    def layout(self) -> tuple[str, ...]:
        """What is behind each button."""
        return ("tone", "silence") if self.interval == 1 else ("silence", "tone")


# --- The trials -----------------------------------------------------------------------------


def _trials(occasion: Occasion, order: Order) -> list[dict[str, Any]]:
    """Rounds of all frequencies, each in random order; either interval equally often (± 1).

    Where the repeats are odd, neighbouring frequencies have one more of different intervals: else
    one interval would be right more often all over the session.
    """
    frequencies_hz = PRACTICE_HZ if occasion.phase == "training" else FREQUENCIES_HZ
    repeats = occasion.study.plan_of("threshold").repeats
    pair = fisher_yates((1, 2), occasion.rng)
    intervals = {
        frequency_hz: fisher_yates(
            [*pair * (repeats // 2), *[pair[place % 2]] * (repeats % 2)], occasion.rng
        )
        for place, frequency_hz in enumerate(frequencies_hz)
    }
    return [
        {
            "texture": NONE,
            "model": NONE,
            "frequency_hz": frequency_hz,
            "interval": intervals[frequency_hz][number],
        }
        for number in range(repeats)
        for frequency_hz in fisher_yates(frequencies_hz, occasion.rng)
    ]


def _adapt(
    trial: ThresholdTrial, rows: Sequence[Mapping[str, object]], rig: TextureRig
) -> ThresholdTrial:
    """With the amplitude that the answers so far ask for, never beyond the rig's limits."""
    burst = ToneBurst(frequency_hz=trial.frequency_hz, amplitude_g=1.0, duration_s=DURATION_S)
    highest_g = min(rig.strongest_g(burst), 10 ** (float(LEVELS_DB[-1]) / 20))
    highest_db = 20 * log10(highest_g)
    if trial.phase == "training":
        level_db = min(PRACTICE_LEVEL_DB, highest_db)
    else:
        level_db = next_level_db(answers_of(rows), trial.frequency_hz, highest_db=highest_db)
    return replace(trial, amplitude_g=10 ** (level_db / 20), highest_g=highest_g)


def _virtual(models: ModelSets, trial: ThresholdTrial) -> list[ToneBurst]:
    """The tone in its interval, and as long a silence in the other one."""
    assert trial.amplitude_g is not None
    return [
        ToneBurst(
            frequency_hz=trial.frequency_hz,
            amplitude_g=trial.amplitude_g if interval == trial.interval else 0.0,
            duration_s=DURATION_S,
        )
        for interval in (1, 2)
    ]


def _begin(trial: ThresholdTrial, surfaces: Surfaces) -> None:
    """Nothing: both intervals begin when their button is pressed."""


def _ask(respondent: Respondent, trial: ThresholdTrial, surfaces: Surfaces) -> Mapping[str, object]:
    choice = respondent.choose(trial, surfaces)
    answer = choice.button + 1
    return {
        "frequency_hz": trial.frequency_hz,
        "amplitude_g": trial.amplitude_g,
        "highest_g": trial.highest_g,
        "interval": trial.interval,
        "answer": answer,
        "correct": int(answer == trial.interval),
        "response_time_s": choice.response_time_s,
    }


TASK = Task(
    name="threshold",
    description=DESCRIPTION,
    trial=ThresholdTrial,
    trials=_trials,
    virtual=_virtual,
    begin=_begin,
    ask=_ask,
    adapt=_adapt,
    mounts=False,
    feel_all=True,
)
