"""The chance of each verdict: simulated studies in several processes, a first answer early."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING

from tactileq.workers import working

if TYPE_CHECKING:
    import pandas as pd

    from tactileq.analysis.power.power import Verdict
    from tactileq.analysis.statistics.participants.posterior import Effort
    from tactileq.benches.power.in_memory import SimulatedStudy

FIRST_ANSWER_S = 12.0  # then the next simulation to end is waited for


def chances(
    people: SimulatedStudy,
    sizes: Sequence[int],
    *,
    simulations: int,
    seed: int,
    jobs: int | None = None,
    dask: str | None = None,
    effort: Effort | None = None,
    advance: Callable[[str], None] = lambda item: None,
    first: Callable[[pd.DataFrame, float], None] = lambda table, left_s: None,
) -> pd.DataFrame:
    """The chance of each verdict on each claim, by n.

    docs/method/power.md#first-n

    Parameters
    ----------
    sizes : sequence of int
        Numbers of participants, none above those of the study.
    seed : int
        ≥ 0.
    jobs : int, optional
        Processes; as many as cores without it. No number of them changes the table.
    dask : str, optional
        Address of a scheduler.
    effort : Effort, optional
        Of the model of the participants, where it decides.
    advance : callable, optional
        Called after each simulation.
    first : callable, optional
        Called once, after `FIRST_ANSWER_S`, with the table so far and the estimated time left (s);
        not called if all simulations are done by then.

    Returns
    -------
    DataFrame
        `tactileq.analysis.power.power.POWER_COLUMNS`.
    """
    from tactileq.analysis.power.power import power_table
    from tactileq.benches.power.in_memory import simulated_verdicts

    work = partial(simulated_verdicts, people, sizes, seed=seed, effort=effort)
    found: dict[int, list[Verdict]] = {}
    began_s = first_s = monotonic()
    sentence = False
    with working(work, range(simulations), jobs=jobs, dask=dask) as done:
        for number, one in done:
            found[number] = one
            advance("")
            now_s, count = monotonic(), len(found)
            if count == 1:
                first_s = now_s  # before it, workers were begun
            elif not sentence and count < simulations and now_s - began_s >= FIRST_ANSWER_S:
                sentence = True
                so_far = (one for each in found.values() for one in each)
                left_s = (simulations - count) * (now_s - first_s) / (count - 1)
                first(power_table(so_far, simulations=count), left_s)
    in_order = (one for number in sorted(found) for one in found[number])
    return power_table(in_order, simulations=simulations)
