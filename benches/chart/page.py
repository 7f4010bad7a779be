"""The page of the speed–accuracy chart: sentences, an interactive chart, pictures and tables."""

from __future__ import annotations

import json
from collections.abc import Iterable
from html import escape
from importlib import resources

import numpy as np
import pandas as pd

from tactileq.analysis.columns import table_bytes
from tactileq.analysis.page.outcomes import described
from tactileq.analysis.page.page import (
    PICTURE_DPI,
    Picture,
    Table,
    bullets,
    grouped,
    page,
    picture_html,
    table_html,
)
from tactileq.analysis.page.saving import png_of, warn_of_missing_fonts
from tactileq.analysis.page.sections import Section
from tactileq.benches.chart.chart import Chart
from tactileq.benches.chart.figure import STYLES, figure_chart
from tactileq.benches.chart.judging import PLACES
from tactileq.benches.chart.methods import OUR_METHOD
from tactileq.benches.chart.summary import (
    METHOD_COLUMNS,
    RIVAL_COMPARISON_COLUMNS,
    comparison_table,
    default_rows,
)
from tactileq.benches.chart.surfaces import SURFACE_KINDS, Kind, counted_kind
from tactileq.modeling.errors import counted
from tactileq.modeling.extras import extra
from tactileq.modeling.files.columns import names, without

COSTS = (
    ("operations", "operations per sample at 5 kHz"),
    ("most_operations", "most operations of one sample"),
    ("ns", "time per rendered sample (ns)"),
    ("numbers", "numbers stored"),
    ("bytes", "bytes of table and state"),
    ("fit_ms", "fitting time per record (ms)"),
)
_PLACE_NAMES = dict(
    zip(PLACES, ("at the conditions", "between them", "during strokes"), strict=True)
)
_MEASURE_NAMES = {
    "distance_db": "log-spectral distance (dB)",
    "bands_db": "error in nine bands (dB)",
    "level_db": "level error (dB)",
    "worst_level_db": "worst level error (dB)",
    "gfc30": "GFC30",
    "gfc5": "GFC5",
}
MEASURES = tuple(
    (f"{place}_{measure}", f"{label} {place_name}")
    for place, place_name in _PLACE_NAMES.items()
    for measure, label in _MEASURE_NAMES.items()
)
_SYMBOLS = {
    "*": "star",
    "o": "circle",
    "D": "diamond",
    "P": "cross",
    "X": "x",
    "s": "square",
    "^": "triangle-up",
    "<": "triangle-left",
    "d": "diamond-tall",
    "p": "pentagon",
    "v": "triangle-down",
    "_": "line-ew",
    "h": "hexagon",
}
FIRST_MEASURE = "stroking_distance_db"

SHOWN_COMPARISONS = without(
    RIVAL_COMPARISON_COLUMNS,
    *(
        "operations_low",
        "operations_high",
        "numbers_low",
        "numbers_high",
        "bytes_low",
        "bytes_high",
    ),
    *("fit_low", "fit_high", "at_low", "at_high", "verdict", "sentence"),
)
METHODS_NOTE = (
    "Medians over the surfaces for the default rendering: each method with its own blending "
    "between conditions, parameter updates every millisecond (grains and FFT-shaped noise: every "
    "block) and "
    "double precision. Operations are counted at 5 kHz and include updates; at most: a sample with "
    "an update. Layers: n/a for methods without layers. Distances are log-spectral distances from "
    "the known truth or, for recordings, from their smoothed spectra; during strokes: while the "
    "hand moves to and fro. Time: rendering alone, all methods in turn in one process; FFT-shaped "
    "noise in NumPy."
)
COMPARISON_NOTE = (
    "Ratios of the rival to joint: geometric means over surfaces, with 95% intervals from "
    "Student's t of the logarithms. A variant is a method with an update interval and a blending. "
    "One variant dominates another if it needs no more operations and is closer to the truth, with "
    "the upper limits of both intervals at most 1; one method dominates another if each variant of "
    "that one is dominated by one of its own (ours: all methods with layers). This is judged at "
    "rest between the conditions and during strokes."
)


def chart_tables(chart: Chart) -> tuple[Table, Table]:
    """The methods by default, and our default against every rival."""
    simulated = bool(chart.summary["simulated"].any())
    usual = chart.summary.loc[default_rows(chart.summary).index]
    single = chart.summary.dropna(subset=["single_error_db"])
    largest = single.groupby(["kind", "method"])["single_error_db"].max()
    worst = usual.drop(columns="single_error_db").join(largest, on=["kind", "method"])
    return (
        Table(
            "chart_comparisons",
            "Which method dominates which",
            COMPARISON_NOTE,
            comparison_table(chart.comparisons),
            SHOWN_COMPARISONS,
            simulated,
        ),
        Table(
            "chart_methods",
            "All methods",
            METHODS_NOTE,
            worst.assign(layers=worst["layers"].where(worst["layers"] >= 0))[names(METHOD_COLUMNS)],
            METHOD_COLUMNS,
            simulated,
        ),
    )


def chart_pictures(chart: Chart) -> tuple[Picture, ...]:
    """A picture for each kind of surface."""
    return tuple(
        Picture(
            f"chart_{kind}",
            f"Speed against accuracy: {SURFACE_KINDS[kind]}",
            "Farther left is cheaper, lower is closer to the truth. The black line connects the "
            "variants that no other variant beats in both. How to read the chart: docs/chart.md.",
            figure_chart(chart, kind),
            bool(chart.summary["simulated"].any()),
        )
        for kind in chart.kinds
    )


def chart_section(chart: Chart) -> Section:
    """The section of the report: the content of the page without the interactive chart."""
    return Section(
        "chart",
        "Speed against accuracy",
        (*chart_pictures(chart), *chart_tables(chart)),
        outcomes=tuple(described(filter(None, (_in_short(chart, kind) for kind in chart.kinds)))),
        done=(
            f"{_counted(chart)} were modelled by {chart.rows['method'].nunique()} methods, each "
            "rendered in several ways and compared with the truth.",
        ),
    )


def _in_short(chart: Chart, kind: Kind) -> str:
    """How many rivals are cheaper than our default, and how many nearer; empty without any."""
    found = [one for one in chart.comparisons if one.kind == kind]
    if not found:
        return ""
    cost = {one.rival: one.ratios["operations"].mean for one in found}
    place = "between" if np.isnan(found[0].ratios["stroking"].mean) else "stroking"
    distance = {one.rival: one.ratios[place].mean for one in found}
    where = {"between": "between the conditions", "stroking": "during strokes"}[place]
    cheaper = [rival for rival in cost if cost[rival] < 1]
    nearer = [rival for rival in distance if distance[rival] < 1]
    nearest = min(distance, key=lambda rival: distance[rival])
    named = f" ({', '.join(nearer)})" if nearer else ""
    return (
        f"On {SURFACE_KINDS[kind]}: {len(cheaper)} of {counted(len(found), 'rival')} need fewer "
        f"operations than {OUR_METHOD}, and {len(nearer)}{named} come nearer to the truth {where}; "
        f"the nearest, {nearest}, has {distance[nearest]:.2f} times the distance for "
        f"{cost[nearest]:.2f} times the operations."
    )


def _counted(chart: Chart) -> str:
    surfaces = chart.rows.groupby("kind", sort=False)["surface"].nunique()
    return ", ".join(counted_kind(surfaces[kind], kind) for kind in chart.kinds)


def chart_files(chart: Chart) -> dict[str, bytes]:
    """Everything by file name: tables, a picture for each kind of surface, and the page."""
    tables = {
        "rows.tsv": chart.rows,
        "summary.tsv": chart.summary,
        "fronts.tsv": chart.fronts,
        "comparisons.tsv": comparison_table(chart.comparisons),
    }
    pictures = chart_pictures(chart)
    drawn = [png_of(picture.figure, dpi=PICTURE_DPI) for picture in pictures]
    warn_of_missing_fonts("".join(lacking for _, lacking in drawn))
    shown = "".join(
        picture_html(picture, png) for picture, (png, _) in zip(pictures, drawn, strict=True)
    )
    return {
        **{name: table_bytes(table) for name, table in tables.items()},
        **{f"{p.name}.png": png for p, (png, _) in zip(pictures, drawn, strict=True)},
        "chart.html": _page(chart, shown).encode(),
    }


def _page(chart: Chart, pictures: str) -> str:
    """The page as self-contained HTML."""
    comparison, methods = chart_tables(chart)
    compared = grouped(
        {
            f"On {SURFACE_KINDS[kind]}": [c.sentence for c in chart.comparisons if c.kind == kind]
            for kind in chart.kinds
        }
    )
    simulated = chart.rows.groupby("kind", sort=False)["simulated"].any()
    which = ", ".join(str(kind) for kind, is_so in simulated.items() if is_so)
    return page(
        title="Speed against accuracy",
        answer=f"{_counted(chart)}: what each way to model and render a texture costs, and how "
        "close it comes to the truth.",
        lead=f"Operation counts do not depend on the machine; times are those of {chart.machine}.",
        banner=f"SIMULATED: recordings of {which} surfaces were not made with a rig."
        if which
        else "",
        sections=[
            ("says", "Which method dominates which", compared + table_html(comparison)),
            ("interactive", "Choose the axes", _interactive(chart)),
            ("pictures", "The charts", pictures),
            ("methods", "All methods", table_html(methods) + bullets(chart.warnings)),
        ],
    )


def plotly_script() -> str:
    """Plotly, which draws the page's interactive chart.

    Raises
    ------
    MissingExtra
        Without the extra chart.
    """
    with extra("chart"):
        from plotly.offline import get_plotlyjs
    script: str = get_plotlyjs()
    return script


def _interactive(chart: Chart) -> str:
    kinds = [(kind, SURFACE_KINDS[kind]) for kind in chart.kinds]
    data = json.dumps(_data(chart), allow_nan=False).replace("</", "<\\/")
    script = resources.files("tactileq.benches.chart").joinpath("chart_page.js")
    return (
        "<p>"
        + _select("kind", "Surfaces", kinds)
        + _select("cost", "Cost", COSTS)
        + _select("measure", "Measure", MEASURES, chosen=FIRST_MEASURE)
        + '<label><input type="checkbox" id="chart-variants" checked> all updates, blendings and '
        "precisions</label></p>"
        '<div id="chart-plot"></div>'
        f'<script type="application/json" id="chart-data">{data}</script>'
        f"<script>{plotly_script()}</script>"
        f"<script>{script.read_text(encoding='utf-8')}</script>"
    )


def _select(name: str, label: str, options: Iterable[tuple[str, str]], *, chosen: str = "") -> str:
    listed = "".join(
        f'<option value="{escape(value)}"{" selected" * (value == chosen)}>{escape(text)}</option>'
        for value, text in options
    )
    return f'<label>{label} <select id="chart-{name}">{listed}</select></label> '


def _data(chart: Chart) -> dict[str, object]:
    """The data that the script draws, with null for unknown values."""
    summary = chart.summary
    usual = summary.index.isin(default_rows(summary).index)
    names = ["kind", "method", "family", "blending", "update_ms", "precision"]
    values = [name for name, _ in (*COSTS, *MEASURES)]
    rows = summary[[*names, *values]].assign(usual=usual).astype(object)
    known: pd.DataFrame = rows.where(rows.notna(), None)
    return {
        "rows": known.to_dict(orient="records"),
        "costs": COSTS,
        "measures": MEASURES,
        "styles": {f: (colour, _SYMBOLS[marker]) for f, (colour, marker, _) in STYLES.items()},
        "simulated": sorted(set(summary.loc[summary["simulated"], "kind"])),
    }
