"""From the rows of all textures to the chart: medians, fronts, and dominance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from tactileq.benches.chart.judging import AT, BETWEEN, DOUBLE, PLACES, STROKING, UPDATES_MS
from tactileq.benches.chart.measures import SUMMARIES
from tactileq.benches.chart.methods import OUR_FAMILIES, OUR_METHOD, RIVALS
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.files.columns import Column, Columns, names
from tactileq.modeling.models.texture_model import BLENDINGS

VARIANT = ["kind", "method", "family", "blending", "default_blending", "update_ms", "precision"]
COSTS = ("operations", "most_operations", "numbers", "bytes", "fit_ms", "layers")
MEASURES = tuple(f"{place}_{name}" for place in PLACES for name in SUMMARIES)
CONFIDENCE = 0.95
FEWEST_SURFACES = 3


METHOD_COLUMNS: Columns = (
    Column("kind", "surfaces", is_name=True),
    Column("method", is_name=True),
    Column("layers", format="g"),
    Column("numbers", "numbers stored"),
    Column("operations", "operations per sample"),
    Column("most_operations", "operations, at most"),
    Column("bytes"),
    Column("ns", "time per sample", "ns"),
    Column("fit_ms", "fitting time per record", "ms"),
    Column("at_gfc30", "GFC30 at conditions", format=".4f"),
    Column("at_distance_db", "distance at conditions", "dB"),
    Column("between_distance_db", "distance between conditions", "dB"),
    Column("between_distance_db_worst", "distance between, worst surface", "dB"),
    Column("stroking_distance_db", "distance during strokes", "dB"),
    Column("between_worst_level_db", "worst level error between", "dB"),
    Column("single_error_db", "error of single precision", "dB"),
)


def summarised(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per kind of surface and variant: medians over the surfaces, and their spread.

    Parameters
    ----------
    rows : DataFrame
        From `judging.judge`, of all textures.

    Returns
    -------
    DataFrame
        The columns of `VARIANT`; of each cost and measure the median and, with _25 and _75, the
        quartiles; _worst of the distances (the largest); single_error_db (the largest); surfaces,
        simulated.
    """
    grouped = rows.groupby(VARIANT, sort=False, dropna=False)
    values = [*COSTS, *MEASURES]
    parts: list[pd.DataFrame | pd.Series[Any]] = [grouped[values].median()]
    parts += [grouped[values].quantile(q).add_suffix(f"_{q:.0%}"[:-1]) for q in (0.25, 0.75)]
    distances = [f"{place}_distance_db" for place in PLACES]
    parts.append(grouped[distances].max().add_suffix("_worst"))
    parts.append(grouped[["single_error_db"]].max())
    parts.append(grouped["surface"].nunique().rename("surfaces"))
    parts.append(grouped["simulated"].any())
    return pd.concat(parts, axis=1).reset_index()


def on_front(cost: Floats, error: Floats) -> Bools:
    """Which of n points are not dominated: none is at least as cheap and close, and better in one.

    Points with a NaN are never on the front.
    """
    known = np.isfinite(cost) & np.isfinite(error)
    beaten = np.array(
        [
            bool(((cost <= c) & (error <= e) & ((cost < c) | (error < e)) & known).any())
            for c, e in zip(cost, error, strict=True)
        ],
        dtype=np.bool_,
    )
    return known & ~beaten


class Ratio(NamedTuple):
    """A geometric mean of ratios over surfaces with its 95 % interval (NaN of too few)."""

    mean: float
    low: float
    high: float

    @property
    def is_known(self) -> bool:
        return bool(np.isfinite(self.low))

    def text(self) -> str:
        """`1.8 (1.6–2.1)`."""
        between = f" ({_short(self.low)}–{_short(self.high)})" if self.is_known else ""
        return f"{_short(self.mean)}{between}"


def _short(value: float) -> str:
    """With two digits, as `0.42`, `1.8` or `1,400`."""
    return f"{float(f'{value:.2g}'):,.4g}" if value < 1e4 else f"{value:,.0f}"


def ratio_over_surfaces(numerator: Floats, denominator: Floats) -> Ratio:
    """Of paired (n,) values > 0; the interval is Student's t for the mean of the logarithms."""
    logs = np.log(numerator / denominator)
    logs = logs[np.isfinite(logs)]
    mean = float(np.exp(logs.mean())) if logs.size else float("nan")
    if logs.size < FEWEST_SURFACES:
        return Ratio(mean, float("nan"), float("nan"))
    if np.ptp(logs) < 1e-12:
        return Ratio(mean, mean, mean)
    half = stdtrit(logs.size - 1, (1 + CONFIDENCE) / 2) * logs.std(ddof=1) / np.sqrt(logs.size)
    low, high = np.exp(logs.mean() + np.array([-half, half]))
    return Ratio(mean, float(low), float(high))


@dataclass(frozen=True)
class Variant:
    """A method with its blending and update interval, in double precision."""

    method: str
    blending: str
    update_ms: float

    def text(self) -> str:
        """`joint, 2 layers (logarithmic, every 4 ms)`."""
        blended = f"{self.blending}, " * (self.blending in BLENDINGS)
        return f"{self.method} ({blended}every {self.update_ms:g} ms)"


@dataclass(frozen=True)
class Dominating:
    """A variant with no more operations and a smaller distance, confirmed by both intervals."""

    variant: Variant
    operations: Ratio
    distance: Ratio

    def text(self) -> str:
        """The variant with its ratios."""
        return (
            f"{self.variant.text()}, {self.operations.text()} times the operations and "
            f"{self.distance.text()} times the distance"
        )


# What our default is compared with a rival's in, each by its column of the rows.
_COMPARED = {
    "operations": "operations",
    "numbers": "numbers",
    "bytes": "bytes",
    "fit": "fit_ms",
    AT: f"{AT}_distance_db",
    BETWEEN: f"{BETWEEN}_distance_db",
    STROKING: f"{STROKING}_distance_db",
}
_AHEAD = {
    "operations": "operations",
    "numbers": "numbers stored",
    "bytes": "bytes",
    "fit": "fitting time",
    AT: "distance at the conditions",
    BETWEEN: "distance between them",
    STROKING: "distance during strokes",
}
AHEAD = 0.99  # a ratio of at most this is more than a difference of rounding
# Where dominance is judged: at rest no update is late; during strokes all are.
_HANDS = {BETWEEN: "At rest between the conditions", STROKING: "During strokes"}


@dataclass(frozen=True, kw_only=True)
class RivalComparison:
    """Our default against one rival's, on one kind of surface.

    Parameters
    ----------
    ratios : mapping of str to Ratio
        The rival's over ours, by the names of `_COMPARED`: costs, and distances from the truth.
    worst_db : (rival's, ours)
        Distance between the conditions on the worst surface.
    dominated_by, dominates_by : mapping of place to Dominating
        Between the conditions and during strokes, where one method dominates the other: each of
        its variants is dominated by a variant of the other. Of those that dominate the default
        the one that is closest to the truth.
    """

    kind: str
    rival: str
    ratios: Mapping[str, Ratio]
    worst_db: tuple[float, float]
    surfaces: int
    dominated_by: Mapping[str, Dominating]
    dominates_by: Mapping[str, Dominating]

    @property
    def ahead(self) -> str:
        """In what the rival's default is ahead of ours, by the intervals."""
        found = [
            f"{_AHEAD[name]} ({_short(ratio.mean)} times)"
            for name, ratio in self.ratios.items()
            if ratio.high < AHEAD
        ]
        theirs, ours = self.worst_db
        if theirs < AHEAD * ours:
            found.append(f"the worst surface between ({theirs:.2g} compared with {ours:.2g} dB)")
        return ", ".join(found) or "nothing"

    @property
    def verdict(self) -> str:
        """Which dominates: no more operations and a smaller distance, by both intervals."""
        if self.surfaces < FEWEST_SURFACES:
            return f"too few surfaces to assess dominance, {FEWEST_SURFACES} are needed"
        found = []
        for place, hand in _HANDS.items():
            if place in self.dominates_by:
                stated = f"it dominates joint ({self.dominates_by[place].text()})"
            elif place in self.dominated_by:
                stated = f"it is dominated ({self.dominated_by[place].text()})"
            elif np.isfinite(self.ratios[place].mean):
                stated = "neither dominates the other"
            else:
                continue
            found.append(f"{hand} {stated}")
        return ". ".join(found)

    @property
    def sentence(self) -> str:
        """The comparison in words."""
        farther = (
            f"Between the conditions the log-spectral distance of {self.rival} from the truth is "
            f"{self.ratios[BETWEEN].text()} times that of joint"
        )
        if np.isfinite(self.ratios[STROKING].mean):
            farther += f", during strokes {self.ratios[STROKING].text()} times"
        costs = (
            f"{self.ratios['operations'].text()} times the operations and "
            f"{self.ratios['numbers'].text()} times the numbers"
        )
        return f"{farther}; it needs {costs}. It is ahead in {self.ahead}. {self.verdict}."


def comparisons(rows: pd.DataFrame) -> list[RivalComparison]:
    """Our default against every rival, surface by surface, for each kind of surface."""
    found = []
    # Recordings whose halves were held out in turn give two rows per surface, averaged as one case.
    by_surface = rows[rows["precision"] == DOUBLE].groupby([*VARIANT, "surface"], sort=False)
    cases = by_surface.mean(numeric_only=True).reset_index()
    for kind, of_kind in cases.groupby("kind", sort=False):
        defaults = default_rows(of_kind).set_index("surface")
        mine = defaults[defaults["method"] == OUR_METHOD]
        variants = _variants(of_kind)
        for rival in RIVALS:
            other = defaults[defaults["method"] == rival]
            if len(mine.index.intersection(other.index)):
                found.append(_comparison(variants, mine, other, kind=str(kind), rival=rival))
    return found


def _comparison(
    variants: Sequence[pd.DataFrame],
    mine: pd.DataFrame,
    other: pd.DataFrame,
    *,
    kind: str,
    rival: str,
) -> RivalComparison:
    """Of one rival; all tables are indexed by surface."""
    pair = _paired(other, mine)
    theirs = [rows for rows in variants if rows["method"].iloc[0] == rival]
    ours = [rows for rows in variants if rows["family"].iloc[0] in OUR_FAMILIES]
    own = [rows for rows in variants if rows["method"].iloc[0] == OUR_METHOD]
    between = f"{BETWEEN}_distance_db"
    return RivalComparison(
        kind=kind,
        rival=rival,
        ratios={name: _ratio(column, *pair) for name, column in _COMPARED.items()},
        worst_db=(float(pair[0][between].max()), float(pair[1][between].max())),
        surfaces=len(pair[0]),
        dominated_by=dict(_dominated(theirs, other, by=ours)),
        dominates_by=dict(_dominated(own, mine, by=theirs)),
    )


def _dominated(
    method: Sequence[pd.DataFrame], default: pd.DataFrame, *, by: Sequence[pd.DataFrame]
) -> Iterator[tuple[str, Dominating]]:
    """Places where every variant of a method is dominated, with what dominates its default."""
    for place in _HANDS:
        if all(_dominating(by, variant, place) for variant in method):
            found = _dominating(by, default, place)
            assert found is not None, "the default is one of the variants"
            yield place, found


def _variants(rows: pd.DataFrame) -> list[pd.DataFrame]:
    """The rows of each variant, indexed by surface."""
    by_variant = rows.groupby(["method", "blending", "update_ms"], sort=False)
    return [variant.set_index("surface") for _, variant in by_variant]


def _dominating(
    variants: Sequence[pd.DataFrame], target: pd.DataFrame, place: str
) -> Dominating | None:
    """The closest to the truth of the variants that dominate a target; indexed by surface."""
    found = []
    for rows in variants:
        pair = _paired(rows, target)
        operations = _ratio("operations", *pair)
        if not operations.high <= 1:  # or unknown
            continue
        distance = _ratio(f"{place}_distance_db", *pair)
        if distance.high <= 1 and distance.mean < 1:
            first = rows.iloc[0]
            variant = Variant(first["method"], first["blending"], float(first["update_ms"]))
            found.append(Dominating(variant, operations, distance))
    return min(found, key=lambda one: one.distance.mean, default=None)


def _paired(first: pd.DataFrame, second: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows of the surfaces that both have."""
    if first.index.equals(second.index):
        return first, second
    both = first.index.intersection(second.index)
    return first.loc[both], second.loc[both]


def _ratio(column: str, numerator: pd.DataFrame, denominator: pd.DataFrame) -> Ratio:
    above, below = (table[column].to_numpy(dtype=float) for table in (numerator, denominator))
    with np.errstate(divide="ignore", invalid="ignore"):
        return ratio_over_surfaces(above, below)


def default_rows(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows of each method as the program renders it: its own blending, 1 ms, double.

    Blocks and grains at their own interval.
    """
    own_interval = ~rows["update_ms"].isin(UPDATES_MS)
    usual = (rows["update_ms"] == UPDATES_MS[0]) | own_interval
    return rows[rows["default_blending"] & usual & (rows["precision"] == DOUBLE)]


def front_of(variants: pd.DataFrame, *, cost: str, error: str) -> pd.DataFrame:
    """The rows on the front of two columns, cheapest first; the first of coinciding ones."""
    front = variants[on_front(variants[cost].to_numpy(), variants[error].to_numpy())]
    return front.drop_duplicates([cost, error]).sort_values(cost)


def front_table(summary: pd.DataFrame) -> pd.DataFrame:
    """For each kind and place the variants on the front of operations against distance.

    Returns
    -------
    DataFrame
        kind, place, method, blending, update_ms, precision, operations, distance_db, simulated;
        cheapest first.
    """
    rows = []
    for _, of_kind in summary[summary["precision"] == DOUBLE].groupby("kind", sort=False):
        for place in PLACES:
            error = f"{place}_distance_db"
            front = front_of(of_kind, cost="operations", error=error)
            rows.append(front.assign(place=place, distance_db=front[error]))
    shown = ["kind", "place", "method", "blending", "update_ms", "precision", "operations"]
    return pd.concat(rows, ignore_index=True)[[*shown, "distance_db", "simulated"]]


def _ratio_columns(name: str, label: str) -> Columns:
    return Column(name, label), Column(f"{name}_low", "95% CI from"), Column(f"{name}_high", "to")


RIVAL_COMPARISON_COLUMNS: Columns = (
    Column("kind", "surfaces", is_name=True),
    Column("rival", is_name=True),
    Column("surfaces", "number of surfaces"),
    *_ratio_columns("operations", "operations, ratio to joint"),
    *_ratio_columns("numbers", "numbers stored, ratio to joint"),
    *_ratio_columns("bytes", "bytes, ratio to joint"),
    *_ratio_columns("fit", "fitting time, ratio to joint"),
    *_ratio_columns(AT, "distance at conditions, ratio to joint"),
    *_ratio_columns(BETWEEN, "distance between, ratio to joint"),
    *_ratio_columns(STROKING, "distance during strokes, ratio to joint"),
    Column("ahead", "ahead of joint in"),
    Column("verdict"),
    Column("sentence"),
)


def comparison_table(found: Sequence[RivalComparison]) -> pd.DataFrame:
    """The comparisons as a table: ratios with their intervals, verdict and sentence."""
    rows = []
    for one in found:
        values = [value for name in _COMPARED for value in one.ratios[name]]
        words = (one.ahead, one.verdict, one.sentence)
        rows.append((one.kind, one.rival, one.surfaces, *values, *words))
    return pd.DataFrame(rows, columns=names(RIVAL_COMPARISON_COLUMNS))
