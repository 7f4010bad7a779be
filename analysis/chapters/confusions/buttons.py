"""Whether some buttons were preferred, whatever lay on them.

docs/method/confusions.md#button-preference
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column, names

Whole = NDArray[np.intp]
REDRAWN = 9999
BATCH = 500  # at once, for the memory
BUTTON_COLUMNS = (
    Column("button"),
    Column("wrong_answers"),
    Column("expected", format=".1f"),
)


@dataclass(frozen=True, eq=False)
class ButtonPreference:
    """Wrong answers by button, and p of layouts that are drawn again.

    `p_shared` is that of a preference that participants share, `p_personal` of preferences that
    each may have for other buttons; NaN where nobody was wrong.
    """

    table: pd.DataFrame
    p_shared: float
    p_personal: float


def button_preference(relative: pd.DataFrame, *, rng: np.random.Generator) -> ButtonPreference:
    """Whether wrong answers fell on some buttons more often than layouts explain.

    The place of a right answer follows from the layout and is not informative. A wrong answer could
    as well have been on any button but the right one, had the layout been drawn again.

    Parameters
    ----------
    relative : DataFrame
        participant_id, texture, answer, layout (textures from button 1 on, separated by |).
    rng : Generator
        Draws layouts.
    """
    wrong = relative[relative["answer"].notna() & (relative["answer"] != relative["texture"])]
    layouts = [str(layout).split("|") for layout in wrong["layout"]]
    buttons = max((len(layout) for layout in layouts), default=0)
    if not layouts:
        return ButtonPreference(
            pd.DataFrame(columns=names(BUTTON_COLUMNS)), float("nan"), float("nan")
        )
    answered = np.array([ly.index(a) for ly, a in zip(layouts, wrong["answer"], strict=True)])
    right = np.array([ly.index(t) for ly, t in zip(layouts, wrong["texture"], strict=True)])
    people = pd.factorize(wrong["participant_id"], sort=True)[0]
    counts = _counts(answered[None, :], people, buttons)
    expected = _expected(right, people, buttons)
    shared, personal = _statistics(counts, expected)
    above = np.ones(2)
    for start in range(0, REDRAWN, BATCH):
        drawn = rng.integers(0, buttons - 1, (min(BATCH, REDRAWN - start), len(right)))
        drawn += drawn >= right  # any button but the right one's
        statistics = _statistics(_counts(drawn, people, buttons), expected)
        above += [
            (s >= o - 1e-9).sum() for s, o in zip(statistics, (shared, personal), strict=True)
        ]
    table = pd.DataFrame(
        {
            "button": range(1, buttons + 1),
            "wrong_answers": counts[0].sum(axis=0),
            "expected": expected.sum(axis=0),
        }
    )
    return ButtonPreference(table, *map(float, above / (REDRAWN + 1)))


def _counts(chosen: Whole, people: Whole, buttons: int) -> Floats:
    """(draws, participants, buttons) answers of (draws, answers) chosen buttons."""
    draws, persons = len(chosen), int(people.max()) + 1
    flat = (np.arange(draws)[:, None] * persons + people) * buttons + chosen
    counted = np.bincount(flat.ravel(), minlength=draws * persons * buttons)
    result: Floats = counted.reshape(draws, persons, buttons).astype(float)
    return result


def _expected(right: Whole, people: Whole, buttons: int) -> Floats:
    """(participants, buttons) answers if every button but the right one's was as likely."""
    expected = np.zeros((int(people.max()) + 1, buttons))
    np.add.at(expected, people, (1 - np.eye(buttons)[right]) / (buttons - 1))
    return expected


def _statistics(counts: Floats, expected: Floats) -> tuple[Floats, Floats]:
    """Pearson's χ² of all together, and the sum of each person's, by draw."""
    # A button that was always the right one is expected to hold no wrong answer, and holds none.
    together = expected.sum(axis=0)
    shared = np.square(counts.sum(axis=1) - together) / np.where(together > 0, together, 1.0)
    personal = np.square(counts - expected) / np.where(expected > 0, expected, 1.0)
    return shared.sum(axis=1), personal.sum(axis=(1, 2))
