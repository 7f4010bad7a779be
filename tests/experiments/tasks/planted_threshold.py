"""Observers with a known threshold, and tables of their answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from tactileq.experiments.sessions.loop.people import Choice
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.tasks.threshold import FREQUENCIES_HZ, ThresholdTrial
from tactileq.experiments.tasks.threshold_posterior import Answer, next_level_db
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.tables import write_table
from tests.experiments.scripted import Scripted

HIGHEST_DB = 14.0
Correct = Callable[[float], float]  # from the level (dB re 1 g) to the share of right answers


def weibull(threshold_db: float, *, slope: float = 2.2, lapse_rate: float = 0.02) -> Correct:
    """Right in 75 % of trials at the threshold, if there were no lapses."""

    def correct(level_db: float) -> float:
        above = 10 ** (slope * (level_db - threshold_db) / 20) * np.log(2)
        return float(0.5 + (0.5 - lapse_rate) * (1 - np.exp(-above)))

    return correct


def asked(
    correct: Correct,
    rng: np.random.Generator,
    *,
    trials: int = 40,
    frequency_hz: float = 250.0,
    highest_db: float = HIGHEST_DB,
) -> list[Answer]:
    """The answers of such an observer to what QUEST+ asks."""
    answers: list[Answer] = []
    for _ in range(trials):
        level_db = next_level_db(answers, frequency_hz, highest_db=highest_db)
        answers.append(
            Answer(
                frequency_hz=frequency_hz,
                level_db=level_db,
                correct=bool(rng.random() < correct(level_db)),
                highest_db=highest_db,
            )
        )
    return answers


def rows_of(answers: Sequence[Answer], **changes: object) -> list[dict[str, object]]:
    """Rows of the table of answers; all of it as in a real one."""
    return [
        {
            "trial": number,
            "phase": "main",
            "texture": "n/a",
            "model": "n/a",
            "tray": "n/a",
            "frequency_hz": answer.frequency_hz,
            "amplitude_g": 10 ** (answer.level_db / 20),
            "highest_g": 10 ** (answer.highest_db / 20),
            "interval": 1,
            "answer": 1 if answer.correct else 2,
            "correct": int(answer.correct),
            "response_time_s": 2.5,
            "run": 1,
            "valid": 1,
            "repeats": "n/a",
            "pilot": "false",
            "simulated": "true",
            **changes,
        }
        for number, answer in enumerate(answers, start=1)
    ]


def write_answers(data: Path, subject: int, rows: Sequence[Mapping[str, object]]) -> Path:
    """The table of one session, in its place below the data folder."""
    start = f"sub-{subject:02d}/ses-01/beh/sub-{subject:02d}_ses-01"
    path = data / f"{start}_task-threshold_beh.tsv"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_table(path, ANSWER_TABLES["threshold"].columns, rows)
    return path


class Feeling(Scripted):
    """Feels each interval once, and finds the tone as often as its thresholds (dB re 1 g) say."""

    def __init__(self, thresholds_db: Sequence[float], *, seed: int = 0) -> None:
        super().__init__()
        self._correct = dict(zip(FREQUENCIES_HZ, map(weibull, thresholds_db), strict=True))
        self._rng = np.random.default_rng(seed)
        self.felt: list[ThresholdTrial] = []

    def choose(self, trial: ThresholdTrial, surfaces: Surfaces) -> Choice:
        surfaces.start()
        for button in (0, 1, 0):  # the third press presents nothing
            surfaces.present_virtual(button)
        assert trial.amplitude_g is not None
        self.felt.append(trial)
        share = self._correct[trial.frequency_hz](20 * np.log10(trial.amplitude_g))
        right = self._rng.random() < share
        button = trial.interval - 1 if right else 2 - trial.interval
        surfaces.choose(button)
        return Choice(button=button, response_time_s=2.5)
