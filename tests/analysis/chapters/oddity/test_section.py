"""The odd one out as d′: shares, intervals and the upper bound."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from tactileq.analysis.answers.plan import AnalysisPlan
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.oddity.section import (
    ODDITY_COLUMNS,
    oddity_section,
    oddity_sensitivity,
    sections,
)
from tactileq.analysis.labels import ALL_TEXTURES, TASK_TITLES
from tactileq.analysis.page.page import Table, table_html
from tactileq.analysis.statistics.caveats import WITHHELD, Caveats
from tactileq.analysis.statistics.claims import Values, claim_tests
from tactileq.analysis.statistics.dprime import oddity_d_prime
from tactileq.analysis.statistics.equivalence import DIFFERENT
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import names
from tactileq.modeling.participants.choices import oddity_share
from tests.analysis.conftest import answered_of

pytestmark = pytest.mark.filterwarnings("error")
MakeFound = Callable[..., ClaimFound]


@pytest.fixture
def odd(plan: AnalysisPlan) -> MakeFound:
    """A claim about the odd one out, of twenty people who are right as often as their d′ says."""

    def make(
        d_primes: Mapping[str, float], *, bounds: tuple[float, float] | None = (-0.15, 0.15)
    ) -> ClaimFound:
        claim = replace(plan.claims[2], task="oddity", bounds=bounds)
        draws = np.random.default_rng(6)
        rows = [
            (texture, f"sub-{who:02d}", 1 / 3, draws.binomial(30, oddity_share(d_prime)) / 30)
            for texture, d_prime in d_primes.items()
            for who in range(20)
        ]
        columns = ["texture", "participant_id", "reference", "other"]
        values = Values(table=pd.DataFrame(rows, columns=columns))
        caveats = Caveats()
        tests = claim_tests(claim, values, caveats=caveats, rng=draws)
        return ClaimFound(claim=claim, tests=tests, values=values.table, caveats=caveats)

    return make


def test_the_declared_chance_is_that_of_who_feels_nothing() -> None:
    assert ANSWER_TABLES["oddity"].chance == pytest.approx(oddity_share(0.0))


def test_planted_d_primes_are_within_their_intervals(odd):
    planted = {"canvas": 0.0, "leather": 1.0, "PVC": 2.5}
    table = oddity_sensitivity(odd(planted)).set_index("texture")
    for texture, d_prime in planted.items():
        row = table.loc[texture]
        # The standard error of 600 answers, four times.
        assert row["share"] == pytest.approx(oddity_share(d_prime), abs=4 * 0.5 / 600**0.5)
        assert row["d_prime_low"] <= row["d_prime"] <= row["d_prime_high"]
        assert_allclose(row["d_prime"], oddity_d_prime(row["share"]))
    assert table.loc["PVC", "d_prime_low"] < 2.5 < table.loc["PVC", "d_prime_high"]
    assert table.loc["canvas", "d_prime_low"] == 0.0
    assert table["verdict"][["canvas", "PVC"]].tolist() == [WITHHELD, DIFFERENT]


def test_the_upper_bound_is_a_share_and_a_d_prime(odd):
    table = oddity_sensitivity(odd({"canvas": 0.0}))
    assert list(table) == names(ODDITY_COLUMNS)
    assert_allclose(table["bound"], 1 / 3 + 0.15)
    assert_allclose([oddity_share(d) for d in table["bound_d_prime"]], table["bound"])
    wide = oddity_sensitivity(odd({"canvas": 0.0}, bounds=(-0.2, 0.9)))
    assert np.isinf(wide["bound_d_prime"]).all()


def answers(*, layout: str = "full|full|simplified") -> Responses:
    """Of somebody who was asked once."""
    row = {"participant_id": "sub-01", "session": "ses-01", "texture": "canvas", "correct": 1.0}
    table = pd.DataFrame([row | {"model": "full", "layout": layout}])
    return Responses({"oddity": table}, simulated_participants=True, simulated_rig=False)


def test_the_section_tells_the_mean_over_textures(odd):
    one = odd({"canvas": 0.0, "PVC": 2.5})
    section = oddity_section([one], answers())
    (table,) = section.items
    assert isinstance(table, Table)
    assert table.frame["texture"].tolist() == [ALL_TEXTURES, "canvas", "PVC"]
    assert "(SIMULATED)" in table_html(table)
    (told,) = (outcome.sentence for outcome in section.outcomes)
    assert "of the answers were right over all textures (95% CI " in told
    bound = oddity_d_prime(1 / 3 + 0.15)
    assert told.endswith(f"; upper bound 48.3%, d′ {bound:.2f}; different.")


def test_without_bounds_there_is_no_bound(odd):
    section = oddity_section([odd({"canvas": 1.0}, bounds=None)], answers())
    (told,) = (outcome.sentence for outcome in section.outcomes)
    assert "bound" not in told


def test_everybody_right_is_infinite_without_interval(odd):
    one = odd({"canvas": 20.0})
    row = oddity_sensitivity(one).iloc[1]
    assert (row["share"], row["d_prime"]) == (1.0, np.inf)
    assert np.isnan(row["d_prime_low"])
    section = oddity_section([one], answers())
    assert "100.0% of the answers were right over all textures, d′ ∞" in (
        section.outcomes[0].sentence
    )


def test_other_tasks_and_nobody_have_no_section(odd, choices):
    one = odd({"canvas": 0.0})
    nobody = replace(one, tests=one.tests[:0])
    assert sections(answered_of(answers(), found=[nobody])) == []
    other = replace(one, claim=replace(one.claim, task="relative"))
    chosen = replace(answers(), answers={"relative": choices})
    assert sections(answered_of(chosen, found=[other])) == []
    (section,) = sections(answered_of(answers(), found=[one]))
    assert section.done == ("Oddity task: 1 simulated participant, 1 trial (without training).",)


def test_another_task_of_this_kind_has_its_own_section(odd, monkeypatch):
    """Which task it is about follows from what is declared, not from the name."""
    table = replace(ANSWER_TABLES["oddity"], title="triangle test")
    monkeypatch.setitem(ANSWER_TABLES, "triangle", table)
    monkeypatch.setitem(TASK_TITLES, "triangle", table.title)
    one = odd({"canvas": 1.0})
    one = replace(one, claim=replace(one.claim, task="triangle"))
    asked = replace(answers(), answers={"triangle": answers().answers["oddity"]})
    (section,) = sections(answered_of(asked, found=[one]))
    assert (section.anchor, section.heading) == ("oddity-triangle", "Triangle test: d′")
    assert [item.name for item in section.items if isinstance(item, Table)] == ["oddity_triangle"]
