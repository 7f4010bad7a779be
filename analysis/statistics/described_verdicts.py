"""Verdicts described: by set-up, beside planted differences, and who is missing in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from tactileq.analysis.answers.responses import Responses, setup_of
from tactileq.analysis.columns import TEXTURE
from tactileq.analysis.labels import TASK_TITLES
from tactileq.analysis.statistics.caveats import DIFFERENCES, EQUALITY, Caveats
from tactileq.analysis.statistics.claims import CONTROL
from tactileq.analysis.statistics.compared_answers import (
    all_claims,
    claim_values,
)
from tactileq.analysis.statistics.paired import (
    t_test,
    why_undefined,
    without_rounding_noise,
)
from tactileq.analysis.statistics.verdicts import ClaimFound
from tactileq.modeling import InputError
from tactileq.modeling.files.columns import Column, names

SETUP_COLUMNS = (
    Column("claim", is_name=True),
    Column("setup", "set-up", is_name=True),
    Column("n"),
    Column("mean_difference", "difference"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
)


def differences_by_setup(found: Sequence[ClaimFound]) -> pd.DataFrame:
    """The mean difference over all textures at each set-up; no row where there is only one.

    Returns
    -------
    DataFrame
        `SETUP_COLUMNS`; of participants who are complete in all textures that are compared.
    """
    rows = []
    for one in found:
        compared = one.values[~one.values["texture"].isin(list(one.caveats.identical))]
        lacking = compared["other"].isna() | compared["reference"].isna()
        incomplete_ones = compared["participant_id"][lacking]
        whole = compared[~compared["participant_id"].isin(incomplete_ones)]
        differences = (whole["other"] - whole["reference"]).groupby(whole["participant_id"]).mean()
        names_of = setup_of(pd.Series(differences.index, index=differences.index, dtype=object))
        for name, each in differences.groupby(names_of) if names_of.nunique() > 1 else ():
            values = without_rounding_noise(each.to_numpy(dtype=float))
            low, high = (np.nan, np.nan) if why_undefined(values) else t_test(values)[2:]
            row = {"claim": one.claim.name, "setup": name, "n": len(each)}
            rows.append({**row, "mean_difference": each.mean(), "ci_low": low, "ci_high": high})
    return pd.DataFrame(rows, columns=names(SETUP_COLUMNS))


PLANTED_COLUMNS = (
    Column("claim", is_name=True),
    TEXTURE,
    Column("planted"),
    Column("mean_difference", "difference"),
    Column("ci_low", "95% CI from"),
    Column("ci_high", "to"),
    Column("verdict", is_name=True),
    Column("agreement"),
)


def planted_verdicts(
    found: Sequence[ClaimFound], planted: Mapping[str, Mapping[str, float]]
) -> pd.DataFrame:
    """Verdicts compared with the differences planted in simulated participants.

    Parameters
    ----------
    planted : mapping of texture to mapping of measure to points
        Other − reference. Measures without planted differences are left out.

    Returns
    -------
    DataFrame
        `PLANTED_COLUMNS`. A verdict agrees where it matches the planted difference,
        contradicts where it states the opposite (a difference where none was planted, equivalence
        where the planted one reaches a bound), and is otherwise undecided.
    """
    rows = []
    for one in found:
        points = {t: of[one.claim.measure] for t, of in planted.items() if one.claim.measure in of}
        tests = one.tests[one.tests["verdict"] != CONTROL]
        compared = [texture for texture in tests["texture"] if texture in points]
        for row in tests.to_dict("records") if compared else ():
            mean = float(np.mean([points[texture] for texture in compared]))
            truth = points.get(row["texture"], mean)
            agreement = _agreement(row["verdict"], truth, bounds=one.claim.bounds)
            rows.append({**row, "planted": truth, "agreement": agreement})
    return pd.DataFrame(rows, columns=names(PLANTED_COLUMNS))


def _agreement(verdict: str, truth: float, *, bounds: tuple[float, float] | None) -> str:
    within = bounds is not None and bounds[0] < truth < bounds[1]
    wrong_equality = not within and verdict in EQUALITY
    wrong_difference = truth == 0 and verdict in DIFFERENCES
    if wrong_equality or wrong_difference:
        return "contradicts"
    return "agrees" if verdict in (*EQUALITY, *DIFFERENCES) else "undecided"


def check_complete(responses: Responses) -> None:
    """Refuse participants who lack answers to a texture with one of two models.

    Raises
    ------
    InputError
        Names them, and the textures.
    """
    lacking: dict[str, dict[str, None]] = {}
    for claim in all_claims(responses):
        caveats = Caveats(identical=responses.identical(claim.models))
        values = claim_values(responses, claim).table
        one = ClaimFound(claim=claim, tests=pd.DataFrame(), values=values, caveats=caveats)
        for participant, texture in incomplete(one):
            lacking.setdefault(participant, {})[f"{TASK_TITLES[claim.task]} of {texture}"] = None
    if not lacking:
        return
    (who, what), *others = lacking.items()
    more = f", and of {len(others)} more ({', '.join(w for w, _ in others[:5])}" if others else ""
    more += ", …)" if len(others) > 5 else ")" * bool(others)
    shown = ", ".join(list(what)[:3]) + (", …" if len(what) > 3 else "")
    raise InputError(
        f"expected all planned answers on both models of every texture, got too few of {who} "
        f"({shown}){more}; let them finish, leave them out with a reason (--exclude), or compare "
        "complete pairs alone (--complete)."
    )


def incomplete(found: ClaimFound) -> Iterator[tuple[str, str]]:
    """Participant and texture of each pair that lacks an answer, identical ones left out."""
    values = found.values
    lacking = values[["reference", "other"]].isna().any(axis=1)
    lacking &= ~values["texture"].isin(list(found.caveats.identical))
    for row in values[lacking].to_dict("records"):
        yield str(row["participant_id"]), str(row["texture"])
