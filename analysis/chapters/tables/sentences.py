"""What the tests on a table say, in sentences."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from tactileq.analysis.answers.imported import ImportedAnswers
from tactileq.analysis.chapters.tables.factorial import CompleteCells
from tactileq.modeling.errors import counted, shortened
from tactileq.modeling.files.columns import Column, p_value

ALPHA = 0.05
FEW = 4  # levels or interactions that a sentence lists
MOST_NAMES = 200  # characters
NO_F = "so that F and p of this test do not exist"
D_PRIME = Column("d_prime", "d′", format=".2f")
Row = Mapping[Hashable, Any]


def measure_of(imported: ImportedAnswers) -> str:
    """What is averaged, as a heading has it."""
    if imported.response:
        return f"share of answers '{imported.response}'"
    return "accuracy" if imported.measure == "correct" else "mean"


def subject_of(imported: ImportedAnswers) -> str:
    """The same inside a sentence."""
    measure = measure_of(imported)
    return measure if measure == "accuracy" else f"the {measure}"


def sentence_of(text: str) -> str:
    """With a capital letter; all others stay as they are."""
    return text[:1].upper() + text[1:]


def listed(items: Sequence[str], last: str = "and") -> str:
    """`A, B and C`."""
    *first, end = items
    return f"{', '.join(first)} {last} {end}" if first else end


def figures(*values: float) -> list[str]:
    """Numbers with two decimals or fewer, with more where only those show that they differ."""
    known = [value for value in values if np.isfinite(value)]
    largest, spread = max(map(abs, known)), float(np.ptp(known))
    if 0 < largest < 0.001:
        return [Column("mean", format=".3g").text(value) for value in values]
    decimals = 2 if largest < 10 else 1 if largest < 100 else 0
    if spread > 1e-9 * largest:
        decimals = max(decimals, int(1 - np.floor(np.log10(spread) + 1e-6)))
    return [Column("mean", format=f".{decimals}f").text(value) for value in values]


def effect_sentences(
    complete: CompleteCells, anova: pd.DataFrame, *, pairs: pd.DataFrame, subject: str
) -> list[str]:
    """A sentence for each main effect, then for interactions that were found, then on all others.

    Parameters
    ----------
    anova, pairs : DataFrame
        From `factorial.repeated_measures_anova` and `factorial.pairwise_tests`.
    subject : str
        From `subject_of`.
    """
    rows = anova.to_dict("records")
    count = len(complete.levels)
    main, interactions = rows[:count], rows[count:]
    sentences = [_main_effect(row, complete, pairs=pairs, subject=subject) for row in main]
    shown = [row for row in interactions if row["p_corrected"] < ALPHA]
    sentences += [_interaction(row, complete, subject) for row in shown]
    alike = [str(row["effect"]) for row in interactions if np.isnan(row["F"])]
    if alike:
        what, verb = ("interaction", "is") if len(alike) == 1 else ("interactions", "are")
        sentences.append(
            f"The {what} {listed(alike)} {verb} exactly the same {_in_each(rows[0])}, {NO_F}."
        )
    others = [row for row in interactions if row not in shown and not np.isnan(row["F"])]
    return sentences + [_no_interaction(others)] * bool(others)


def _main_effect(row: Row, complete: CompleteCells, *, pairs: pd.DataFrame, subject: str) -> str:
    factor = str(row["effect"])
    means = complete.level_means(factor)
    if np.isnan(row["F"]):
        return _alike(row, means, pairs=pairs[pairs["factor"] == factor], subject=subject)
    found = f"{subject} differs between levels of {factor} ({_levels(means)}; {_test(row)})."
    shown = row["p_corrected"] < ALPHA
    return sentence_of(found if shown else f"we found no evidence that {found}")


def _alike(row: Row, means: Mapping[str, float], *, pairs: pd.DataFrame, subject: str) -> str:
    """Of differences that are the same in every participant."""
    levels = f"levels of {row['effect']}"
    if not pairs["mean_difference"].any():
        value = figures(next(iter(means.values())))[0]
        same = f"{subject} is exactly the same at all {levels} {_in_each(row)} (mean {value})"
        return f"{sentence_of(same)}, {NO_F}."
    what = f"The differences in {subject} between {levels} are exactly the same"
    least = "the least "
    if len(means) == 2:
        pair = pairs.iloc[0]
        difference = Column("mean").text(pair["mean_difference"])
        what = f"The difference in {subject} between {levels} ({pair['pair']}) is exactly "
        what, least = what + difference, ""
    return (
        f"{what} {_in_each(row)} ({_levels(means)}), {NO_F}; p of sign flips is "
        f"in the table of pairs ({least}{_p(pairs['p_holm'].min())})."
    )


def _in_each(row: Row) -> str:
    return f"in each of the {row['n']} participants"


def _interaction(row: Row, complete: CompleteCells, subject: str) -> str:
    factors = [name for name in complete.levels if name in str(row["effect"]).split(" × ")]
    other = "factor" if len(factors) == 2 else "factors"
    return (
        f"The effects of {listed(factors)} on {subject} depend on each other "
        f"({row['effect']}: {_test(row)}): each of their main effects is an average that need not "
        f"hold at every level of the other {other}."
    )


def _no_interaction(rows: Sequence[Row]) -> str:
    if len(rows) <= FEW:
        tests = "; ".join(f"{row['effect']}: {_test(row)}" for row in rows)
    else:
        least = min(float(row["p_corrected"]) for row in rows)
        tests = f"{len(rows)} tests, the least {_p(least)}"
    return f"We found no evidence of {'an interaction' if len(rows) == 1 else 'interactions'} " + (
        f"({tests})."
    )


def _levels(means: Mapping[str, float]) -> str:
    return _extremes(means, figures(*means.values()), noun="levels")


def _extremes(means: Mapping[str, float], shown: Sequence[str], *, noun: str) -> str:
    """Each with its number, or the lowest and the highest of many."""
    text = dict(zip(means, shown, strict=True))
    if len(means) <= FEW:
        return ", ".join(f"{level}: {text[level]}" for level in means)
    low, high = min(means, key=means.__getitem__), max(means, key=means.__getitem__)
    return f"{len(means)} {noun}, from {text[low]} for {low} to {text[high]} for {high}"


def _test(row: Row) -> str:
    """F with its degrees of freedom, corrected where they can be."""
    df, corrected = f"{row['df_effect']}, {row['df_error']}", ""
    if row["df_effect"] > 1:
        df = f"{row['df_effect_corrected']:.2f}, {row['df_error_corrected']:.2f}"
        corrected = " (Greenhouse–Geisser)"
    eta = f"generalized η² = {row['generalized_eta_squared']:.3f}"
    return f"F({df}) = {row['F']:.2f}, {_p(row['p_corrected'])}{corrected}, {eta}"


def _p(p: float) -> str:
    return f"p {p_value(p)}" if p < 0.001 else f"p = {p_value(p)}"


def mean_sentence(
    imported: ImportedAnswers, cells: pd.DataFrame, *, overall: tuple[float, float, float]
) -> str:
    """The mean over participants, with its interval; of a single one that of the trials.

    Parameters
    ----------
    cells : DataFrame
        From `factorial.participant_cells`.
    overall : (float, float, float)
        From `factorial.overall_mean`.
    """
    people = cells["participant_id"].nunique()
    mean, low, high = overall
    over = f"over {counted(people, 'participant')}"
    if len(cells) == 1:
        low, high = cells.loc[cells.index[0], ["ci_low", "ci_high"]]
        over = f"over {counted(int(cells['trials'].sum()), 'trial')} of one participant"
    text = figures(mean, low, high)
    alike = " (the same in all)" if people > 1 else ""
    interval = f" (95% CI {text[1]} to {text[2]})" if np.isfinite(low) else alike
    conditions = cells["condition"].nunique()
    where = f" and {conditions} conditions" if conditions > 1 else ""
    return f"{sentence_of(subject_of(imported))} is {text[0]} {over}{where}{interval}."


def chance_sentences(found: pd.DataFrame, chance: float) -> list[str]:
    """How the conditions compare with chance.

    Parameters
    ----------
    found : DataFrame
        From `chance.against_chance`.
    """
    tested = found[found["p_holm"].notna()]
    if len(found) == 1:
        return [_one_condition(row, chance) for row in tested.to_dict("records")]
    is_shown = tested["p_holm"] < ALPHA
    above = tested["mean"] > chance
    groups = {
        "Accuracy is above chance": tested[is_shown & above],
        "Accuracy is below chance": tested[is_shown & ~above],
        "We found no evidence that accuracy differs from chance": tested[~is_shown],
    }
    return [
        f"{finding} ({chance:.3f}; {_how(rows)} over participants, Holm-corrected, "
        f"{_range(rows['p_holm'])}) in {_conditions(rows, found)}."
        for finding, rows in groups.items()
        if len(rows)
    ]


def _how(rows: pd.DataFrame) -> str:
    known = rows["t"].notna()
    return " or ".join(["t-tests"] * bool(known.any()) + ["sign flips"] * bool(not known.all()))


def _range(p: pd.Series) -> str:
    """Of p values on one side of 0.05."""
    if p_value(p.min()) == p_value(p.max()):
        return "all " * (len(p) > 1) + _p(p.max())
    return f"all p ≤ {p_value(p.max())}" if p.max() < ALPHA else f"all p ≥ {p_value(p.min())}"


def _conditions(rows: pd.DataFrame, found: pd.DataFrame) -> str:
    if len(rows) == len(found):
        return "both conditions" if len(found) == 2 else f"all {len(found)} conditions"
    names = shortened("; ".join(rows["condition"]), longest=MOST_NAMES)
    return f"{len(rows)} of {len(found)} conditions: {names}"


def d_prime_sentence(found: pd.DataFrame, model: str) -> str:
    """The sensitivities of the conditions by this model; empty where none is known."""
    known = found[found["d_prime"].notna()]
    if known.empty:
        return ""
    if len(found) > 1:
        values = dict(zip(known["condition"], known["d_prime"], strict=True))
        shown = [D_PRIME.text(value) for value in values.values()]
        return f"d′ ({model}): {_extremes(values, shown, noun='conditions')}."
    row = known.iloc[0]
    interval = ""
    if np.isfinite([row["d_prime_low"], row["d_prime_high"]]).all():
        low, high = (D_PRIME.text(row[name]) for name in ("d_prime_low", "d_prime_high"))
        interval = f"95% CI {low} to {high}; "
    return f"d′ is {D_PRIME.text(row['d_prime'])} ({interval}{model})."


def _one_condition(row: Row, chance: float) -> str:
    how = f"t({row['df']}) = {row['t']:.2f}".replace("-", "−")
    how = how if np.isfinite(row["t"]) else f"sign flips, n = {row['n']}"
    test = f"({chance:.3f}; {how}, {_p(row['p'])})"
    if row["p"] >= ALPHA:
        return f"We found no evidence that accuracy differs from chance {test}."
    return f"Accuracy is {'above' if row['mean'] > chance else 'below'} chance {test}."


def participants_above(cells: pd.DataFrame, chance: float) -> str:
    """How many participants are above chance by their own trials, wherever they answered.

    Parameters
    ----------
    cells : DataFrame
        From `factorial.participant_cells`, with p_above_chance.
    """
    p = cells["p_above_chance"]
    people, conditions = cells["participant_id"].nunique(), cells["condition"].nunique()
    if len(cells) == 1:
        test = f"({chance:.3f}; exact binomial test over trials, one-sided, {_p(p.iloc[0])})"
        found = f"the participant answered above chance {test}."
        return sentence_of(found if p.iloc[0] < ALPHA else f"we found no evidence that {found}")
    test = f"({chance:.3f}; exact binomial tests over trials, one-sided, p < .05 each, uncorrected)"
    if people == 1:
        which = f"{(p < ALPHA).sum()} of {conditions} conditions"
        return f"The participant answered above chance {test} in {which}."
    above = (p.groupby(cells["participant_id"]).max() < ALPHA).sum()
    everywhere = " in each of their conditions" if conditions > 1 else ""
    return f"{above} of {people} participants answered above chance {test}{everywhere}."


def other_answers(answers: pd.DataFrame, presented: Sequence[str]) -> str:
    """That answers which name no presented class are wrong; empty where there are none."""
    other = answers[~answers["answered"].isin(presented)]
    counts = other.groupby("answered", sort=False)["count"].sum()
    if not counts.sum():
        return ""
    kinds = listed([f'{counted(int(n), "answer")} "{name}"' for name, n in counts.items()])
    verb = "counts" if counts.sum() == 1 else "count"
    return f"Chance is one of {len(presented)} presented classes; {kinds} {verb} as wrong."
