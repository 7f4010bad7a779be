"""A self-contained HTML page: style, tables and pictures inline, all text escaped."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import pandas as pd
from matplotlib.figure import Figure

from tactileq.modeling.files.columns import Column, Columns, names

PICTURE_DPI = 150
PIXELS_PER_INCH = 92
MOST_COLUMNS_AT_FULL_SIZE = 11
MOST_ROWS_KEPT_TOGETHER = 15
LONGEST_WORD_KEPT_WHOLE = 20  # letters, on paper
MOST_ROWS, ROWS_OF_LONGER = 200, 20  # shown of a table; its file has all

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
nav { margin-top: 16px; font-size: 15px; display: flex; flex-wrap: wrap; }
nav a { color: var(--blue); text-decoration: none; margin-right: 22px; white-space: nowrap; }
nav a:hover { text-decoration: underline; }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
          padding: 26px 30px; margin: 26px 0; }
.points li { font-size: 17px; line-height: 1.4; }
.front .caution { grid-column: 1 / -1; }
.front { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 0 34px; }
details.supplement { margin-top: 22px; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(205px, 1fr)); gap: 14px; }
.tile { border: 1px solid var(--line); border-radius: 8px; padding: 14px 16px; }
.tile b { display: block; font-size: 23px; line-height: 1.25; white-space: nowrap;
          color: var(--blue); }
.tile span { color: var(--soft); font-size: 14px; }
h4 { margin: 16px 0 0; font-size: 15px; color: var(--soft); }
.answer { margin: 10px 0 12px; padding-left: 14px; border-left: 4px solid var(--blue);
          font-size: 19px; line-height: 1.45; max-width: 90ch; }
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
/* Landscape, since many tables are too wide for portrait pages. */
@page { size: A4 landscape; margin: 12mm; }
@page upright { size: A4 portrait; margin: 12mm; }
@media print {
  body { background: none; font-size: 10.5pt; }
  main, header > div, footer, .banner div { max-width: none; padding: 0; }
  header { padding: 8px 0; } nav { display: none; }
  .banner { padding: 6px 10px; print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  section { border: 0; border-radius: 0; padding: 0; margin: 16px 0; }
  h2, h3, h4, summary, caption { break-after: avoid; }
  figure, .tile, .short, caption, tr { break-inside: avoid; }
  figure img { max-height: 155mm; width: auto; }
  figure.tall, h2:has(+ figure.tall) { page: upright; }
  figure.tall img { max-height: 240mm; }
  .scroll { overflow: visible; }
  /* A report is read upright; its supplement is a file of its own, with wide tables. */
  body.report { page: upright; font-size: 9.5pt; line-height: 1.4; }
  body.report details.supplement { display: none; }
  body.report section { break-inside: avoid; margin: 0 0 9mm; }
  /* The first page, with the header: one sheet. */
  body.report #overview { break-inside: auto; break-after: page; margin: 0; }
  body.report #overview > h2 { display: none; }
  body.report #overview img { max-height: 66mm; }
  body.report #overview figcaption { font-size: 7.5pt; line-height: 1.25; }
  body.report .caution { margin-top: 8px; }
  body.report figure img { max-height: 125mm; max-width: 100%; }
  body.report figure.tall { page: auto; }
  body.report h1 { font-size: 17pt; } body.report h2 { font-size: 13pt; margin-bottom: 4px; }
  body.report h3 { font-size: 10pt; margin: 10px 0 2px; }
  body.report .answer, body.report .points li { font-size: 10.5pt; margin: 3px 0 5px; }
  body.report ul { margin: 3px 0 0; } body.report li { margin: 2px 0; }
  body.report figure { margin: 6px 0; }
  body.report .front { grid-template-columns: 1fr 1fr 1fr; gap: 0 16px; font-size: 8.5pt; }
  body.report .tiles { grid-template-columns: repeat(auto-fit, minmax(32mm, 1fr)); gap: 6px; }
  body.report .tile { padding: 4px 7px; } body.report .tile b { font-size: 12pt; }
  body.report .tile span { display: block; }
  body.report .tile span, body.report .lead { font-size: 8pt; line-height: 1.25; }
  table { width: 100%; font-size: 8pt; }
  .wide table { font-size: 7pt; }
  thead { display: table-header-group; }
  /* Keep the first and the last rows of a table together on a page. */
  tbody tr:nth-child(-n + 3), tbody tr:nth-last-child(-n + 2) { break-before: avoid; }
  th, td { padding: 2px 6px 2px 0; }
  td.name { white-space: normal; }
  /* Break within a word only where it would not fit on a line, so that no column is cut. */
  td.long { overflow-wrap: anywhere; }
  caption, figcaption, p, ul, .answer, .lead { max-width: none; }
  caption, figcaption { font-size: 9pt; }
  /* Unfold folded parts when printing, where the browser supports it without a script. */
  details::details-content { content-visibility: visible; display: block; block-size: auto; }
  summary { list-style: none; }
}
"""

# Browsers without ::details-content would print folded parts closed, so they are opened.
UNFOLD_FOR_PRINT = """
const folds = document.getElementsByTagName("details");
addEventListener("beforeprint", () => { for (const fold of folds) {
  if (!fold.open) { fold.open = true; fold.dataset.folded = ""; } } });
addEventListener("afterprint", () => { for (const fold of folds) {
  if ("folded" in fold.dataset) { fold.open = false; delete fold.dataset.folded; } } });
"""


@dataclass(frozen=True, eq=False)
class Table:
    """A table of the report: `name` is its file's stem, `title` and `note` its caption.

    The page shows `columns`, in this order and as they say, and of very long tables only the
    beginning; the file holds all of `frame`.
    """

    name: str
    title: str
    note: str
    frame: pd.DataFrame
    columns: Columns
    simulated: bool


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


def paragraph(heading: str, text: str) -> str:
    """Plain text below a heading."""
    return f"<h3>{escape(heading)}</h3><p>{escape(text)}</p>"


def bullets(sentences: Sequence[str]) -> str:
    """A list of plain sentences; nothing where there are none."""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>" if items else ""


def headline_html(answer: str, points: Sequence[str]) -> str:
    """The answer of a page: a sentence, or what several points are about."""
    listed = "".join(f"<li>{escape(point)}</li>" for point in points)
    points_html = f'<ul class="points">{listed}</ul>' if points else ""
    return f'<p class="answer">{escape(answer)}</p>{points_html}'


def findings_html(findings: Sequence[str]) -> str:
    """What a chapter says: its answer, which stands out, and the rest in a list."""
    first, *rest = findings
    return f'<p class="answer">{escape(first)}</p>{bullets(rest)}'


def supplement_html(summary: str, content: str) -> str:
    """What opens on a click on the screen, and is printed from a file of its own."""
    return f'<details class="supplement"><summary>{escape(summary)}</summary>{content}</details>'


def grouped(groups: Mapping[str, Sequence[str]]) -> str:
    """Lists of plain sentences, each below its heading."""
    return "".join(f"<h4>{escape(head)}</h4>{bullets(said)}" for head, said in groups.items())


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


def picture_html(picture: Picture, png: bytes) -> str:
    """The figure inline, with its caption."""
    data = base64.b64encode(png).decode("ascii")
    # One scale for all pictures, so that their text has one size.
    width, height = picture.figure.get_size_inches() * PIXELS_PER_INCH
    tall = ' class="tall"' if height > width else ""
    return (
        f'<figure id="figure-{escape(picture.name)}"{tall}>'
        f'<img alt="{escape(_full_title(picture))}" width="{round(width)}" '
        f'src="data:image/png;base64,{data}">'
        f"<figcaption>{_caption(picture)}</figcaption></figure>"
    )


def table_html(table: Table) -> str:
    """The table with its caption; numbers are rounded, the file beside the report is exact."""
    columns = _with_content(table)
    frame = table.frame[names(columns)]
    cut = ""
    if len(frame) > MOST_ROWS:
        cut = f" Rows 1 to {ROWS_OF_LONGER} of {len(frame)}; all are in tables/{table.name}.tsv."
        frame = frame[:ROWS_OF_LONGER]
    css = [_css(column, frame[column.name]) for column in columns]
    head = "".join(
        f"<th {c}>{escape(column.heading)}</th>" for column, c in zip(columns, css, strict=True)
    )
    rows = "".join(
        _row_html(columns, values, css=css) for values in frame.itertuples(index=False, name=None)
    )
    return (
        f'<div class="{_classes(columns, len(frame))}" id="table-{escape(table.name)}"><table>'
        f"<caption>{_caption(table)}{escape(cut)}</caption><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _classes(columns: Columns, rows: int) -> str:
    """On paper a table of many columns is set smaller, and one of few rows stays on one page."""
    wide, short = len(columns) > MOST_COLUMNS_AT_FULL_SIZE, rows <= MOST_ROWS_KEPT_TOGETHER
    return "scroll" + " wide" * wide + " short" * short


def _with_content(table: Table) -> Columns:
    """Leave out columns of notes that are all empty."""
    frame = table.frame
    return tuple(
        column for column in table.columns if frame.empty or (frame[column.name] != "").any()
    )


def _css(column: Column, values: pd.Series) -> str:
    if pd.api.types.is_numeric_dtype(values):
        return 'class="number"'
    words = (word for value in values for word in column.text(value).split())
    long = any(len(word) > LONGEST_WORD_KEPT_WHOLE for word in words)
    classes = ["name"] * column.is_name + ["long"] * long
    return f'class="{" ".join(classes)}"' if classes else ""


def _row_html(columns: Columns, values: Sequence[object], *, css: Sequence[str]) -> str:
    cells = "".join(
        f"<td {c}{_title(column.tooltip(value))}>{escape(column.text(value))}</td>"
        for column, value, c in zip(columns, values, css, strict=True)
    )
    total = any(column.is_total(value) for column, value in zip(columns, values, strict=True))
    return f'<tr class="total">{cells}</tr>' if total else f"<tr>{cells}</tr>"


def page(
    *,
    title: str,
    answer: str,
    lead: str,
    banner: str,
    sections: Sequence[tuple[str, str, str]],
    points: Sequence[str] = (),
    kind: str = "",
) -> str:
    """The whole page from (anchor, heading, HTML) sections; no banner where its text is empty.

    Parameters
    ----------
    points : sequence of str
        What `answer` announces.
    kind : str
        "report" is printed upright and without its supplements.
    """
    kind_html = f' class="{escape(kind)}"' if kind else ""
    links = "".join(f'<a href="#{escape(a)}">{escape(heading)}</a>' for a, heading, _ in sections)
    warning = f'<div class="banner"><div>{escape(banner)}</div></div>' if banner else ""
    body = "".join(section(a, heading, content=html) for a, heading, html in sections)
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{STYLE}</style></head><body{kind_html}>{warning}"
        f"<header><div><h1>{escape(title)}</h1>"
        f'{headline_html(answer, points)}<p class="lead">{escape(lead)}</p>'
        f"<nav>{links}</nav></div></header>"
        f"<main>{body}</main><script>{UNFOLD_FOR_PRINT}</script></body></html>\n"
    )


def _title(tooltip: str) -> str:
    return f' title="{escape(tooltip)}"' if tooltip else ""


def _full_title(item: Table | Picture) -> str:
    return f"{item.title} (SIMULATED)" if item.simulated else item.title


def _caption(item: Table | Picture) -> str:
    return f"<b>{escape(_full_title(item))}.</b> {escape(item.note)}"
