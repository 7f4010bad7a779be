"""What the estimators promise on 201 random spectra with known layers, three kinds of truth.

docs/method/estimation.md#random-spectra
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.textures.recovery import match_layers
from tactileq.modeling import PEQ, Layers, Recording, find_layers, similarity, spectrum
from tactileq.modeling.seeds import generator
from tactileq.stimuli.planted.spectra import KINDS, RATE_HZ, RandomTruth, TruthKind, random_truth

pytestmark = pytest.mark.long("a sweep of 201 random spectra")
PER_KIND = 67
SEED = 1
STEP_HZ = 0.5
ESTIMATORS = ("joint", "paper")  # the paper's second reading finds the same peaks
LIKENESS = ("gfc30", "gfc30_deficit", "rms_error_db")


def level_errors_db(truth: RandomTruth, found: PEQ, partner: np.ndarray) -> np.ndarray:
    """Of the gain where layers are coherent, else of the energy within ±B/2."""
    planted, mine = truth.layers, np.flatnonzero(partner >= 0)
    if truth.kind == "coherent":
        return 20 * np.log10(np.abs(found.gains[partner[mine]]) / planted.gains[mine])
    frequency = np.arange(STEP_HZ, RATE_HZ / 2, STEP_HZ)
    expected, got = truth.expected_power(frequency), found.response(frequency) ** 2
    within = [
        np.abs(frequency - planted.frequencies_hz[i]) <= planted.bandwidths_hz[i] / 2 for i in mine
    ]
    return np.array([10 * np.log10(got[w].sum() / expected[w].sum()) for w in within])


def scores_of(truth: RandomTruth, found: Layers) -> dict[str, object]:
    partner = match_layers(
        truth.layers.frequencies_hz,
        truth.layers.bandwidths_hz,
        estimated_frequency_hz=found.frequencies_hz,
    )
    return {
        "matched": int((partner >= 0).sum()),
        "found": found.gains.size,
        "true": truth.layers.gains.size,
        "level_errors_db": level_errors_db(truth, found.peq(rate_hz=RATE_HZ), partner),
    }


def scores_of_kind(kind: TruthKind) -> list[dict[str, object]]:
    rng = generator([SEED, KINDS.index(kind)])
    rows = []
    for _ in range(PER_KIND):
        truth = random_truth(kind, rng=rng)
        record = Recording(truth.record(rng=rng), RATE_HZ, 100.0, 1.0, "random", simulated=True)
        measured = spectrum(record)
        layers = [find_layers(measured, estimator=name) for name in ESTIMATORS]
        reports = similarity.reports(measured, [found.peq(rate_hz=RATE_HZ) for found in layers])
        for name, found, report in zip(ESTIMATORS, layers, reports, strict=True):
            likeness = {label: getattr(report, label) for label in LIKENESS}
            rows.append({"kind": kind, "estimator": name, **likeness, **scores_of(truth, found)})
    return rows


@pytest.fixture(scope="module")
def scores(once_per_run) -> pd.DataFrame:
    return once_per_run(
        "scores", lambda folder: pd.DataFrame(row for kind in KINDS for row in scores_of_kind(kind))
    )


def of(scores: pd.DataFrame, estimator: str, kind: str | None = None) -> pd.DataFrame:
    chosen = scores[scores["estimator"] == estimator]
    return chosen if kind is None else chosen[chosen["kind"] == kind]


@pytest.mark.parametrize(("kind", "share"), [("coherent", 5), ("independent", 5), ("Gaussian", 3)])
def test_joint_leaves_a_small_part_of_the_papers_gap(
    scores: pd.DataFrame, kind: str, share: int
) -> None:
    joint, paper = (of(scores, name, kind)["gfc30_deficit"].mean() for name in ESTIMATORS)
    assert paper > 0.02
    assert joint <= paper / share


def test_what_joint_finds_is_there_and_what_is_there_is_found(scores: pd.DataFrame) -> None:
    sums = {name: of(scores, name)[["matched", "found", "true"]].sum() for name in ESTIMATORS}
    precision = {name: each["matched"] / each["found"] for name, each in sums.items()}
    recall = {name: each["matched"] / each["true"] for name, each in sums.items()}
    assert precision["joint"] >= 0.85
    assert recall["joint"] >= 0.80
    assert precision["paper"] < 0.65
    assert recall["paper"] < recall["joint"]


@pytest.mark.parametrize("kind", KINDS)
def test_levels_are_right(scores: pd.DataFrame, kind: str) -> None:
    joint = of(scores, "joint", kind)
    assert abs(np.median(np.concatenate(list(joint["level_errors_db"])))) <= 0.5
    assert abs(joint["rms_error_db"].mean()) <= 0.3
    assert joint["rms_error_db"].abs().median() <= 0.3
    assert joint["gfc30"].mean() > 0.98
