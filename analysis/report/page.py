"""One HTML page that needs nothing but itself: style, tables and pictures inline, all escaped."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import pandas as pd
from matplotlib.figure import Figure

from analysis.labels import ALL_LAYERS, ALL_TEXTURES

PICTURE_DPI = 150
PIXELS_PER_INCH = 92
_P_VALUES = (
    *("p", "p_holm", "shapiro_p", "wilcoxon_p", "flip_probability"),
    *("p_speed", "p_force", "p_speed_force", "p_speed_alone", "p_amplitude"),
)
_NAMES = (
    *("scale", "texture", "model", "estimator", "layer", "verdict", "presented", "answered"),
    *("parameter", "coefficient", "driven_by", "reduced", "foretold_by"),
    *("worst_level_error_at", "worst_distance_at"),
)
_GRID_AXES = ("_mm_s", "force_n")
_LABELS = {
    "mean_full": "mean full",
    "mean_simplified": "mean simplified",
    "mean_difference": "difference",
    "ci_low": "CI from",
    "ci_high": "to",
    "p_holm": "p (Holm)",
    "d_z": "d_z",
    "d_z_low": "CI from",
    "d_z_high": "to",
    "wilcoxon_p": "Wilcoxon p",
    "se": "SE",
    "rms_error_db": "RMS error (dB)",
    "log_spectral_distance_db": "log-spectral distance (dB)",
    "gfc30_mean": "GFC30 mean",
    "gfc30_min": "GFC30 min",
    "gfc30_floor": "GFC30 floor",
    "gfc30_ceiling": "GFC30 ceiling",
    "gfc5_mean": "GFC5 mean",
    "gfc5_floor": "GFC5 floor",
    "gfc5_ceiling": "GFC5 ceiling",
    "multiple_r": "R",
    "adjusted_r_squared": "adjusted R²",
    "published_adjusted_r_squared": "published",
    "speed_coefficient": "α1 (v)",
    "force_coefficient": "α2 (F)",
    "speed_force_coefficient": "α3 (v·F)",
    "p_speed": "p of α1",
    "p_force": "p of α2",
    "p_speed_force": "p of α3",
    "support_speed": "support α1 (%)",
    "support_force": "support α2 (%)",
    "support_speed_force": "support α3 (%)",
    "published_support_speed": "published α1 (%)",
    "published_support_force": "published α2 (%)",
    "published_support_speed_force": "published α3 (%)",
    "mean_significant": "mean of significant ones",
    "published_for_n": "published, taken as per N",
    "slope_speed_alone": "slope on speed alone (Hz per mm/s)",
    "p_speed_alone": "p",
    "amplitude_r": "r with amplitude",
    "p_amplitude": "p",
    "mean_centroid_hz": "mean (Hz)",
    "foretold_by": "foretold by",
    "median_level_error_db": "level error, median (dB)",
    "worst_level_error_db": "worst (dB)",
    "worst_level_error_at": "at",
    "median_distance_db": "distance, median (dB)",
    "worst_distance_db": "worst (dB)",
    "worst_distance_at": "at",
    "distance_at_db": "distance at (dB)",
    "distance_between_db": "distance between (dB)",
    "median_level_error_between_db": "level error between, median (dB)",
    "worst_level_error_between_db": "worst (dB)",
}
_UNITS = {"hz": "Hz", "db": "dB", "n": "N", "mm_s": "mm/s", "s": "s"}

STYLE = """
:root { --ink: #1b1f24; --soft: #59636e; --line: #d8dee4; --paper: #fff; --tint: #f4f7fa;
        --blue: #0072b2; --warn: #d55e00; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--tint); color: var(--ink);
       font: 16px/1.55 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main, header > div { max-width: 1240px; margin: 0 auto; padding: 0 28px; }
header { background: var(--paper); border-bottom: 1px solid var(--line); padding: 34px 0 22px; }
h1 { margin: 0 0 6px; font-size: 30px; line-height: 1.2; }
h2 { margin: 0 0 12px; font-size: 22px; }
h3 { margin: 30px 0 8px; font-size: 17px; }
.lead { color: var(--soft); margin: 0; max-width: 75ch; }
.banner { background: var(--warn); color: #fff; font-weight: 600; padding: 10px 0; }
.banner div { max-width: 1240px; margin: 0 auto; padding: 0 28px; }
nav { margin-top: 16px; font-size: 15px; }
nav a { color: var(--blue); text-decoration: none; margin-right: 22px; }
nav a:hover { text-decoration: underline; }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
          padding: 26px 30px; margin: 26px 0; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(205px, 1fr)); gap: 14px; }
.tile { border: 1px solid var(--line); border-radius: 8px; padding: 14px 16px; }
.tile b { display: block; font-size: 23px; line-height: 1.25; white-space: nowrap;
          color: var(--blue); }
.tile span { color: var(--soft); font-size: 14px; }
ul { margin: 8px 0 0; padding-left: 22px; max-width: 95ch; } li { margin: 7px 0; }
p { max-width: 95ch; }
.caution { border-left: 4px solid var(--warn); padding: 2px 0 2px 18px; margin-top: 26px; }
.caution h3 { margin-top: 4px; }
figure { margin: 18px 0 26px; } figure img { max-width: 100%; height: auto; display: block; }
figcaption, caption { color: var(--soft); font-size: 14.5px; text-align: left; max-width: 100ch; }
caption { padding-bottom: 8px; } figcaption b, caption b { color: var(--ink); }
.scroll { overflow-x: auto; margin: 18px 0 26px; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th { text-align: left; vertical-align: bottom; font-weight: 600; color: var(--soft);
     border-bottom: 2px solid var(--line); }
th, td { padding: 5px 11px 5px 0; } td { border-bottom: 1px solid var(--line); }
td.number, th.number { text-align: right; } td.number, td.name { white-space: nowrap; }
tr.total td { font-weight: 600; }
details { border-top: 1px solid var(--line); padding: 10px 0; }
summary { cursor: pointer; font-weight: 600; }
footer { max-width: 1240px; margin: 0 auto 40px; padding: 0 28px; color: var(--soft);
         font-size: 14px; }
@media print { body { background: none; } section { border: 0; break-inside: avoid-page; } }
"""


@dataclass(frozen=True, eq=False)
class Table:
    """A table of the report: `name` is its file's stem, `title` and `note` its caption.

    The page shows the columns in `shown` (all where there are none); the file holds all.
    """

    name: str
    title: str
    note: str
    frame: pd.DataFrame
    simulated: bool
    shown: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure of the report: `name` is its file's stem, `title` and `note` its caption."""

    name: str
    title: str
    note: str
    figure: Figure
    simulated: bool


@dataclass(frozen=True, eq=False)
class Fold:
    """Tables and figures that open on a click."""

    summary: str
    items: tuple[Table | Picture, ...]
    opened: bool = False


Item = Table | Picture | Fold


def bullets(sentences: Sequence[str]) -> str:
    """A list of plain sentences; nothing where there are none."""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>" if items else ""


def tiles(figures: Sequence[tuple[str, str]]) -> str:
    """Key figures as (value, what it is)."""
    cells = (
        f'<div class="tile"><b>{escape(value)}</b><span>{escape(label)}</span></div>'
        for value, label in figures
    )
    return f'<div class="tiles">{"".join(cells)}</div>'


def folded(fold: Fold, content: str) -> str:
    """A part that opens on a click; `content` is HTML."""
    state = " open" if fold.opened else ""
    return f"<details{state}><summary>{escape(fold.summary)}</summary>{content}</details>"


def section(anchor: str, heading: str, *, content: str) -> str:
    """A part of the page with its heading; `content` is HTML."""
    return f'<section id="{escape(anchor)}"><h2>{escape(heading)}</h2>{content}</section>'


def picture_png(figure: Figure) -> bytes:
    """The figure as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=PICTURE_DPI)
    return buffer.getvalue()


def picture_html(picture: Picture, png: bytes) -> str:
    """The figure inline, with its caption."""
    data = base64.b64encode(png).decode("ascii")
    # One scale for all pictures, so that their text has one size.
    width = round(picture.figure.get_figwidth() * PIXELS_PER_INCH)
    return (
        f'<figure id="figure-{escape(picture.name)}">'
        f'<img alt="{escape(_full_title(picture))}" width="{width}" '
        f'src="data:image/png;base64,{data}">'
        f"<figcaption>{_caption(picture)}</figcaption></figure>"
    )


def table_html(table: Table) -> str:
    """The table with its caption; numbers are rounded, the file beside the report is exact."""
    frame = table.frame[list(table.shown)] if table.shown else table.frame
    # A column of notes that nobody wrote only takes room.
    frame = frame[[name for name in frame if frame.empty or (frame[name] != "").any()]]
    numeric = [pd.api.types.is_numeric_dtype(frame[name]) for name in frame]
    css = [
        'class="number"' if number else 'class="name"' if name in _NAMES else ""
        for number, name in zip(numeric, frame, strict=True)
    ]
    head = "".join(
        f"<th {c}>{escape(label(str(name)))}</th>" for name, c in zip(frame, css, strict=True)
    )
    rows = []
    for values in frame.itertuples(index=False, name=None):
        cells = "".join(
            f"<td {c}>{escape(cell(str(name), value))}</td>"
            for name, value, c in zip(frame, values, css, strict=True)
        )
        total = ALL_TEXTURES in values or ALL_LAYERS in values
        rows.append(f'<tr class="total">{cells}</tr>' if total else f"<tr>{cells}</tr>")
    return (
        f'<div class="scroll" id="table-{escape(table.name)}"><table><caption>{_caption(table)}'
        f"</caption><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def label(column: str) -> str:
    """A column's name for people: `worst_speed_mm_s` becomes `worst speed (mm/s)`."""
    if column in _LABELS:
        return _LABELS[column]
    for ending, unit in _UNITS.items():
        if column.endswith(f"_{ending}"):
            return f"{column.removesuffix(f'_{ending}').replace('_', ' ')} ({unit})"
    return column.replace("_", " ")


def cell(column: str, value: object) -> str:
    """A value as a table shows it: about three significant digits, `n/a` where there is none."""
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "n/a"
    if column in _P_VALUES:
        return p_value(value)
    if column.startswith(("gfc", "oracle")):
        return f"{value:.4f}"
    if column.endswith(_GRID_AXES):
        return f"{value:g}"
    size = abs(value)
    digits = 0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3
    # Below 1e-12 is what sums of thirds leave of a zero.
    tiny = 1e-12 < size < 0.0005
    return (f"{value:.1e}" if tiny else f"{value:.{digits}f}").replace("-", "−")


def p_value(p: float) -> str:
    """A probability with three decimals, `< .001` below."""
    return "< .001" if p < 0.001 else f"{p:.3f}".replace("0.", ".", 1)


def page(*, title: str, lead: str, banner: str, sections: Sequence[tuple[str, str, str]]) -> str:
    """The whole page from (anchor, heading, HTML) sections; no banner where its text is empty."""
    links = "".join(f'<a href="#{escape(a)}">{escape(heading)}</a>' for a, heading, _ in sections)
    warning = f'<div class="banner"><div>{escape(banner)}</div></div>' if banner else ""
    body = "".join(section(a, heading, content=html) for a, heading, html in sections)
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{STYLE}</style></head><body>{warning}<header><div><h1>{escape(title)}</h1>"
        f'<p class="lead">{escape(lead)}</p><nav>{links}</nav></div></header>'
        f"<main>{body}</main></body></html>\n"
    )


def _full_title(item: Table | Picture) -> str:
    return f"{item.title} (SIMULATED)" if item.simulated else item.title


def _caption(item: Table | Picture) -> str:
    return f"<b>{escape(_full_title(item))}.</b> {escape(item.note)}"
