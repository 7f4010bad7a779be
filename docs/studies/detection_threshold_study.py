"""How well planted detection thresholds are recovered, by trials, compared with a staircase.

Simulated: observers with random smooth thresholds at the eight frequencies of the task answer as
`tactileq.experiments.tasks.threshold` asks (QUEST+), and as a 3-down 1-up staircase of PsychoPy
asks.

Example: python docs/studies/detection_threshold_study.py writes detection_threshold_study.tsv and
.png beside this file and prints the table.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import erf, sqrt
from pathlib import Path

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import finish_axes, shared_legend
from tactileq.analysis.page.drawing import stamp_if_simulated as stamp
from tactileq.experiments.tasks.threshold import FREQUENCIES_HZ
from tactileq.experiments.tasks.threshold_posterior import POINT_DB, Answer, estimate, next_level_db

OBSERVERS = 6  # of each kind
TRIALS = (20, 30, 40, 50, 60)
HIGHEST_DB = 14.0  # 5 g
STAIRCASE_POINT = 0.5 ** (1 / 3)
STEPS_DB = [8, 4, 4, 2]
UNUSED_REVERSALS = 4  # while the steps shrink


@dataclass(frozen=True)
class Kind:
    """Observers of one kind: Weibull's slope (or a normal curve's SD in dB), lapses, drift.

    `drift_db` is how much the threshold rises over the session.
    """

    name: str
    slope: float = 2.2
    lapse_rate: float = 0.02
    drift_db: float = 0.0
    normal_sd_db: float = 0.0

    def correct(self, above_db: float) -> float:
        """Probability of a right answer so far above the threshold (the 75 % point), in dB."""
        if self.normal_sd_db:
            detected = (1 + erf(above_db / self.normal_sd_db / sqrt(2))) / 2
        else:
            detected = 1 - np.exp(-(10 ** ((self.slope * above_db + POINT_DB) / 20)))
        return float(0.5 + (0.5 - self.lapse_rate) * detected)

    def drifted_db(self, trial: int) -> float:
        """How far the threshold has risen at a trial (from 0) above its level at half-time."""
        return self.drift_db * (trial / TRIALS[-1] - 0.5)

    def mean_drift_db(self, trials: int) -> float:
        """The mean of that over so many trials."""
        return self.drift_db * ((trials - 1) / TRIALS[-1] - 1) / 2

    def above_db(self, share: float) -> float:
        """How far above the threshold this share is right; infinite where it never is."""
        levels = np.linspace(-40, 40, 8001)
        reached = np.array([self.correct(level) for level in levels]) >= share
        return float(levels[np.argmax(reached)]) if reached.any() else np.inf


KINDS = (
    Kind("as assumed: slope 2.2, 2 % lapses"),
    Kind("no lapses", lapse_rate=0.0),
    Kind("5 % lapses", lapse_rate=0.05),
    Kind("shallow: slope 1.2", slope=1.2),
    Kind("steep: slope 6, beyond the prior", slope=6.0),
    Kind("normal curve, SD 4 dB", normal_sd_db=4.0),
    Kind("drifting: +4 dB in a session", drift_db=4.0),
    Kind("20 % lapses, beyond the prior", lapse_rate=0.2),
)


def thresholds_db(rng: np.random.Generator) -> np.ndarray:
    """A random smooth curve over the frequencies, dB re 1 g; shaped as those of fingers are."""
    octaves = np.log2(np.array(FREQUENCIES_HZ))
    apart = octaves[:, None] - octaves
    smooth = rng.multivariate_normal(np.zeros(octaves.size), 36 * np.exp(-(apart**2) / 8))
    rise = 10.0 * np.maximum(0, octaves - np.log2(250))
    return np.asarray(np.clip(rng.uniform(-40, -25) + smooth + rise, -70, 8))


def quest_errors(
    kind: Kind, curve_db: np.ndarray, rng: np.random.Generator
) -> Iterator[tuple[int, int, float]]:
    """Place of the frequency, trials at it so far, and error of the estimate (dB)."""
    answers: list[Answer] = []
    for trial in range(TRIALS[-1]):
        for frequency_hz, threshold_db in zip(FREQUENCIES_HZ, curve_db, strict=True):
            level_db = next_level_db(answers, frequency_hz, highest_db=HIGHEST_DB)
            right = rng.random() < kind.correct(level_db - threshold_db - kind.drifted_db(trial))
            answers.append(
                Answer(
                    frequency_hz=frequency_hz,
                    level_db=level_db,
                    correct=bool(right),
                    highest_db=HIGHEST_DB,
                )
            )
        if trial + 1 in TRIALS:
            for place, frequency_hz in enumerate(FREQUENCIES_HZ):
                found_db = estimate(answers, frequency_hz).level_db
                yield place, trial + 1, found_db - curve_db[place] - kind.mean_drift_db(trial + 1)


def staircase_errors(
    kind: Kind, curve_db: np.ndarray, rng: np.random.Generator
) -> Iterator[tuple[int, int, float]]:
    """The same of 3-down 1-up staircases, against the point to which they converge."""
    for place, threshold_db in enumerate(curve_db):
        target_db = threshold_db + kind.above_db(STAIRCASE_POINT)
        for trials, level_db in staircase(kind, float(threshold_db), rng):
            yield place, trials, level_db - target_db - kind.mean_drift_db(trials)


def staircase(
    kind: Kind, threshold_db: float, rng: np.random.Generator
) -> Iterator[tuple[int, float]]:
    """The estimate of a staircase after a number of trials: the mean reversal in steps of 2 dB."""
    from psychopy.data import StairHandler

    stairs = StairHandler(
        startVal=-10.0,
        nTrials=TRIALS[-1],
        nReversals=len(STEPS_DB),
        nUp=1,
        nDown=3,
        stepSizes=STEPS_DB,
        stepType="lin",
        minVal=-70.0,
        maxVal=HIGHEST_DB,
    )
    for trial in range(TRIALS[-1]):
        stairs.finished = False  # goes on however many reversals there were
        level_db = float(next(stairs))
        right = rng.random() < kind.correct(level_db - threshold_db - kind.drifted_db(trial))
        stairs.addResponse(int(right))
        if trial + 1 in TRIALS:
            turned = stairs.reversalIntensities[UNUSED_REVERSALS:]
            yield trial + 1, float(np.mean(turned or [level_db]))


METHODS = {"QUEST+": quest_errors, "3-down 1-up": staircase_errors}


def observer(kind: int, number: int) -> list[dict[str, object]]:
    """Errors of one observer at all frequencies, by method and trials."""
    curve_db = thresholds_db(np.random.default_rng([16, number]))
    return [
        {
            "kind": KINDS[kind].name,
            "method": method,
            "observer": number,
            "frequency_hz": FREQUENCIES_HZ[place],
            "trials": trials,
            "error_db": error_db,
        }
        for method, errors in METHODS.items()
        for place, trials, error_db in errors(
            KINDS[kind], curve_db, np.random.default_rng([17, kind, number, len(method)])
        )
    ]


def summary(errors: pd.DataFrame) -> pd.DataFrame:
    """Mean error, RMS error, and the share of observers below 2 dB RMS over their frequencies."""
    rows = []
    for (kind, method, trials), of in errors.groupby(["kind", "method", "trials"], sort=False):
        own = of.groupby("observer")["error_db"].agg(lambda e: sqrt(float(np.mean(e**2))))
        rows.append(
            {
                "kind": kind,
                "method": method,
                "trials": trials,
                "bias_db": round(float(of["error_db"].mean()), 2),
                "rms_db": round(sqrt(float((of["error_db"] ** 2).mean())), 2),
                "observers_below_2_db": round(float((own < 2).mean()), 2),
            }
        )
    return pd.DataFrame(rows)


def figure(table: pd.DataFrame) -> Figure:
    """RMS error by trials, a panel for each kind."""
    drawn = Figure(figsize=(10, 5.2), layout="constrained")
    panels = drawn.subplots(2, 4, sharex=True, sharey=True).ravel()
    for axes, (kind, rows) in zip(panels, table.groupby("kind", sort=False), strict=True):
        axes.axhline(2.0, color="0.6", linestyle="--", linewidth=1)
        for (method, own), color, marker in zip(
            rows.groupby("method", sort=False), ("#0072B2", "#D55E00"), "os", strict=True
        ):
            axes.plot(own["trials"], own["rms_db"], color=color, marker=marker, label=method)
        axes.set_title(str(kind), fontsize=8, loc="left")
        axes.set(yscale="log", ylim=(0.7, 40))
        axes.set_yticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
        axes.minorticks_off()
        finish_axes(axes)
    for axes in panels[4:]:
        axes.set_xlabel("Trials of each frequency")
    for axes in panels[::4]:
        axes.set_ylabel("RMS error (dB)")
    shared_legend(drawn, panels[:1])
    stamp(panels[3], simulated=True)
    return drawn


def main(folder: Path, observers: int) -> None:
    """Write the table and the figure."""
    work = [(kind, number) for kind in range(len(KINDS)) for number in range(observers)]
    run = Parallel(n_jobs=2)(delayed(observer)(*each) for each in work)
    table = summary(pd.DataFrame([row for rows in run for row in rows]))
    table.to_csv(folder / "detection_threshold_study.tsv", sep="\t", index=False)
    figure(table).savefig(folder / "detection_threshold_study.png", dpi=110)
    print(table.to_string(index=False))


if __name__ == "__main__":
    main(Path(__file__).parent, int(sys.argv[1]) if len(sys.argv) > 1 else OBSERVERS)
