"""The speed–accuracy chart: what every method costs, and how close it is to the truth.

How to read it, and its results: docs/chart.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from tactileq.benches.chart.judging import SINGLE, Judged
from tactileq.benches.chart.summary import (
    RivalComparison,
    comparisons,
    front_table,
    summarised,
)
from tactileq.benches.chart.surfaces import Kind
from tactileq.benches.chart.timing import KEY, TURNS, Key, stream_of, time_table
from tactileq.benches.rendering.bench import processor
from tactileq.benches.rendering.timer import Turn
from tactileq.modeling import InputError


@dataclass(frozen=True, eq=False, kw_only=True)
class Chart:
    """Everything that the chart shows.

    Parameters
    ----------
    rows : DataFrame
        One per texture, method, blending, update interval and precision; see `judging.judge`.
    summary : DataFrame
        Medians and spread over textures, from `summary.summarised`, with ns per rendered sample.
    fronts : DataFrame
        From `summary.front_table`.
    comparisons : tuple of RivalComparison
        Our default against every rival.
    """

    rows: pd.DataFrame
    summary: pd.DataFrame
    fronts: pd.DataFrame
    comparisons: tuple[RivalComparison, ...]
    warnings: tuple[str, ...]
    machine: str

    @property
    def kinds(self) -> list[Kind]:
        """Kinds of surfaces, in the order in which they were judged."""
        return list(self.rows["kind"].unique())


def chart_of(judged: Sequence[Judged], *, turns: int = TURNS) -> Chart:
    """The chart of some textures, rendering timed with the models of the first of each kind.

    Parameters
    ----------
    turns : int
        Of timing.

    Raises
    ------
    InputError
        Where no texture could be modelled by any method.
    """
    rows = pd.concat([one.rows for one in judged], ignore_index=True)
    if rows.empty:
        raise InputError(
            "expected a method that can model one of the textures, got none; see the warnings."
        )
    warnings = [warning for one in judged for warning in one.warnings]
    streams, untimed = _streams(judged)
    times = time_table(streams, turns=turns)
    summary = summarised(rows).merge(times, on=KEY, how="left")
    return Chart(
        rows=rows,
        summary=summary,
        fronts=front_table(summary),
        comparisons=tuple(comparisons(rows)),
        warnings=(*warnings, *untimed),
        machine=processor(),
    )


def _streams(judged: Sequence[Judged]) -> tuple[dict[Key, Turn], list[str]]:
    """Of the first texture of each kind, and why some cannot be timed."""
    streams: dict[Key, Turn] = {}
    untimed: dict[str, None] = {}
    first = {one.source.kind: one for one in reversed(judged) if len(one.rows)}
    for kind, one in first.items():
        variants = one.rows[["method", "blending", "update_ms", "precision"]]
        for method, blending, update_ms, precision in variants.itertuples(index=False):
            fitted = one.fitted[method, blending]
            try:
                stream = stream_of(fitted, update_ms, single=precision == SINGLE)
            except InputError as error:  # no compiler, or numbers that single precision cannot hold
                untimed[f"not timed: {method}: {error}"] = None
                continue
            if stream is not None:
                streams[kind, method, blending, update_ms, precision] = stream
    return streams, list(untimed)
