"""Preferences for buttons: found where planted, not where right answers lie unevenly."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tactileq.analysis.chapters.confusions import buttons
from tactileq.analysis.chapters.confusions.buttons import BUTTON_COLUMNS, button_preference
from tactileq.modeling.files.columns import names

TEXTURES = [f"t{n}" for n in range(7)]


def answers(
    draws: np.random.Generator, *, people: int = 12, trials: int = 42, liked: dict[int, int] | None
) -> pd.DataFrame:
    """Who is right in 40 %; else guesses, one time in three the button that they like."""
    rows = []
    for person in range(people):
        for trial in range(trials):
            layout = list(draws.permutation(TEXTURES))
            texture = TEXTURES[trial % 7]
            answer = texture if draws.random() < 0.4 else str(draws.choice(TEXTURES))
            if liked and answer != texture and draws.random() < 1 / 3:
                answer = layout[liked[person]]
            rows.append((f"sub-{person:02d}", texture, "|".join(layout), answer))
    return pd.DataFrame(rows, columns=["participant_id", "texture", "layout", "answer"])


def rng() -> np.random.Generator:
    return np.random.default_rng(1)


def test_a_button_that_all_like_is_found():
    liked = dict.fromkeys(range(12), 3)
    found = button_preference(answers(np.random.default_rng(2), liked=liked), rng=rng())
    assert list(found.table) == names(BUTTON_COLUMNS)
    assert found.p_shared == found.p_personal == 1 / 10000
    more = found.table["wrong_answers"] - found.table["expected"]
    assert found.table["button"][more.idxmax()] == 4
    assert found.table["expected"].sum() == pytest.approx(found.table["wrong_answers"].sum())


def test_buttons_of_their_own_are_found_as_such():
    liked = {person: person % 7 for person in range(12)}
    found = button_preference(answers(np.random.default_rng(3), liked=liked), rng=rng())
    assert found.p_personal == 1 / 10000
    assert found.p_shared > 0.01


def test_without_a_preference_p_is_uniform(monkeypatch):
    monkeypatch.setattr(buttons, "REDRAWN", 199)
    draws = np.random.default_rng(4)
    found = [
        button_preference(answers(draws, people=5, trials=21, liked=None), rng=draws)
        for _ in range(120)
    ]
    for which in ("p_shared", "p_personal"):
        p = [getattr(one, which) for one in found]
        assert stats.kstest(p, stats.uniform.cdf).pvalue > 0.01


def test_right_answers_are_no_preference():
    # All that is right lies on button 1, and wrong answers are spread evenly over the others.
    rows = []
    for trial in range(60):
        layout = [TEXTURES[0], *np.roll(TEXTURES[1:], trial)]
        answer = TEXTURES[0] if trial % 2 else layout[1 + trial // 2 % 6]
        rows.append(("sub-01", TEXTURES[0], "|".join(layout), answer))
    table = pd.DataFrame(rows, columns=["participant_id", "texture", "layout", "answer"])
    found = button_preference(table, rng=rng())
    assert found.table["expected"][0] == found.table["wrong_answers"][0] == 0
    assert found.p_shared > 0.9


def test_nobody_wrong_leaves_nothing_to_test():
    right = answers(np.random.default_rng(5), people=1, trials=7, liked=None)
    right["answer"] = right["texture"]
    found = button_preference(right, rng=rng())
    assert found.table.empty
    assert np.isnan([found.p_shared, found.p_personal]).all()
