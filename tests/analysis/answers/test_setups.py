"""Answers of several set-ups: one study, participants of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.responses import PlannedTask, Responses, leave_out, setup_of
from tactileq.analysis.answers.setups import answers_at, pool_setups
from tactileq.analysis.statistics.described_verdicts import differences_by_setup
from tactileq.analysis.statistics.verdicts import claims_found
from tactileq.modeling import InputError
from tests.refusals import refused


@pytest.fixture
def leipzig(ratings, choices, plan) -> Responses:
    return Responses(
        {"absolute": ratings, "relative": choices},
        simulated_participants=False,
        simulated_rig=False,
        plan=plan,
        study_sha256="0a",
        planned={"absolute": PlannedTask(16, 16)},
        warnings=("sub-02 was a pilot.",),
    )


@pytest.fixture
def nara(leipzig) -> Responses:
    """Others, who rate simplified models 20 points lower throughout, and answer all right."""
    lower = 20.0 * (leipzig.answers["absolute"]["model"] == "simplified")
    rated = leipzig.answers["absolute"].assign(
        magnitude_similarity=leipzig.answers["absolute"]["magnitude_similarity"] - lower
    )
    plan = replace(leipzig.plan, sha256=("0b",))
    chosen = leipzig.answers["relative"].assign(correct=1.0)
    return replace(leipzig, answers={"absolute": rated, "relative": chosen}, plan=plan)


def test_the_surplus_of_one_set_up_fills_no_gap_of_another(leipzig, nara):
    few = [f"sub-{number:02d}" for number in range(1, 9)]
    answers = {t: a[a["participant_id"].isin(few)] for t, a in nara.answers.items()}
    planned = {task: PlannedTask(12, 12) for task in leipzig.planned}
    fewer = replace(nara, answers=answers, planned=planned)
    both = pool_setups({"leipzig": replace(leipzig, planned=planned), "nara": fewer})
    assert both.done("absolute").participants == 24 == both.planned["absolute"].participants
    assert both.unfinished == fewer.unfinished != ()


def test_people_of_one_number_at_two_set_ups_are_two(leipzig, nara):
    both = pool_setups({"leipzig": leipzig, "nara": nara})
    assert both.answers["absolute"]["participant_id"].nunique() == 32
    assert set(setup_of(both.answers["absolute"]["participant_id"])) == {"leipzig", "nara"}
    assert both.planned["absolute"] == PlannedTask(32, 32)
    assert both.unfinished == ()
    assert both.warnings == ("leipzig: sub-02 was a pilot.", "nara: sub-02 was a pilot.")
    assert both.plan.sha256 == ("0a" * 32, "0b")
    for task, table in answers_at("nara", both.answers).items():
        assert table.reset_index(drop=True).equals(nara.answers[task])
    # Of somebody who is left out at one set-up, and whose answers cannot be read.
    gone = replace(nara, left_out={"absolute": pd.DataFrame([{"participant_id": "sub-17"}])})
    short = leave_out(pool_setups({"leipzig": leipzig, "nara": gone}), {"nara/sub-17": "damaged"})
    assert short.left_out["absolute"]["participant_id"].tolist() == ["nara/sub-17"]
    alone = claims_found(leipzig, rng=np.random.default_rng(0))
    found = claims_found(both, rng=np.random.default_rng(0))
    assert found[0].tests["n"].iloc[0] == 32
    table = differences_by_setup(found)
    assert differences_by_setup(alone).empty
    first, second = (table.iloc[n] for n in (0, 1))
    assert (first["setup"], second["setup"]) == ("leipzig", "nara")
    whole = alone[0].tests.iloc[0]
    for name in ("n", "mean_difference", "ci_low", "ci_high"):
        assert first[name] == pytest.approx(whole[name])
    assert second["mean_difference"] == pytest.approx(first["mean_difference"] - 20)


def test_set_ups_that_are_not_alike_are_refused(leipzig, nara):
    for other, what in (
        (replace(nara, study_sha256="0b"), "study"),
        (replace(nara, models={"canvas": {"full": "1"}}), "models"),
        (replace(nara, simulated_participants=True), "simulated participants"),
        (replace(nara, simulated_rig=True), "simulated rig"),
    ):
        with refused(InputError, got=[what, "'nara'"]):
            pool_setups({"leipzig": leipzig, "nara": other})
    with refused(InputError, names=["answers", "'nara'"]):
        pool_setups({"leipzig": leipzig, "nara": replace(leipzig)})
    with refused(InputError, expected="/", got="'leipzig/2'"):
        pool_setups({"leipzig/2": leipzig, "nara": nara})
