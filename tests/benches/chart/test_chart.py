"""The chart's tables, pictures and page."""

from __future__ import annotations

import json
import re

import numpy as np
import pandas as pd
import pytest

from tactileq.benches.chart.chart import Chart
from tactileq.benches.chart.figure import PANELS, figure_chart
from tactileq.benches.chart.judging import Judged
from tactileq.benches.chart.page import COSTS, MEASURES, chart_files, chart_section, chart_tables
from tactileq.benches.chart.surfaces import counted_kind
from tactileq.benches.chart.timing import stream_of, time_table
from tactileq.benches.rendering.timer import Turn


@pytest.mark.long("the times of this machine")
def test_rendering_is_timed_in_turn_and_what_cannot_be_is_not(chart: Chart) -> None:
    times = chart.summary.groupby(["method", "precision"])["ns"].count()
    assert times["joint, 1 layer", "single"] > 0
    assert times["AR(6)", "double"] > 0
    assert times["truth", "double"] == 0
    assert ("AR(6)", "single") not in times  # it would need another form
    timed = chart.summary.dropna(subset=["ns"])
    assert (timed["ns_25"] <= timed["ns"]).all()
    assert (timed["ns"] <= timed["ns_75"]).all()
    assert (timed["ns"] > 0).all()


def test_turns_are_taken_by_all_in_the_same_order() -> None:
    calls: list[str] = []
    streams = {
        ("drawn", name, "", 1.0, "double"): Turn(lambda name=name: calls.append(name), 1)
        for name in ("a", "b")
    }
    table = time_table(streams, turns=3)
    assert calls == ["a", "b"] * 5  # two turns warm up
    assert table["method"].tolist() == ["a", "b"]


def test_fft_shaped_noise_renders_as_many_samples_as_are_counted(judged: list[Judged]) -> None:
    stream = stream_of(judged[0].fitted["FFT, 1/16 s", ""], 1.0, single=False)
    assert stream is not None
    assert np.size(stream.run()) == stream.samples


def test_the_picture_names_its_axes_and_says_that_it_is_simulated(chart: Chart) -> None:
    figure = figure_chart(chart, "drawn")
    axes = [ax for ax in figure.axes if ax.get_visible()]
    assert len(axes) == len(PANELS)
    assert [ax.get_xlabel() for ax in axes] == [panel.cost_label for panel in PANELS]
    assert all("dB" in ax.get_ylabel() for ax in axes)
    told = [text.get_text() for ax in axes for text in ax.texts]
    assert "SIMULATED" in told
    assert {"1", "2", "6", "floor", "consistent"} <= set(told)


def test_a_picture_of_recordings_has_no_panel_for_what_is_not_known(chart: Chart) -> None:
    blind = chart.summary.copy()
    blind.loc[:, [c for c in blind if c.startswith("stroking")]] = np.nan
    shown = Chart(**(vars(chart) | {"summary": blind}))
    axes = [ax for ax in figure_chart(shown, "drawn").axes if ax.get_visible()]
    assert [ax.get_title(loc="left") for ax in axes] == [
        panel.title for panel in PANELS if panel.place != "stroking"
    ]


@pytest.fixture(scope="module")
def page(chart: Chart) -> str:
    return chart_files(chart)["chart.html"].decode()


def test_the_page_needs_nothing_but_itself(page: str) -> None:
    own = page.split("<script>/**")[0]
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", own)
    assert "SIMULATED" in page
    assert page.count("<select") == 3


def test_the_page_holds_all_rows_and_axes(page: str, chart: Chart) -> None:
    text = re.search(r'id="chart-data">(.*?)</script>', page, re.DOTALL)
    assert text is not None
    data = json.loads(text.group(1))
    assert len(data["rows"]) == len(chart.summary)
    for name, _ in (*COSTS, *MEASURES):
        assert name in data["rows"][0]
        assert f'<option value="{name}"' in page
    assert {row["family"] for row in data["rows"]} <= set(data["styles"])
    known = pd.DataFrame(data["rows"])
    assert known["operations"].notna().sum() == chart.summary["operations"].notna().sum()


def test_the_section_of_a_report_has_picture_and_tables(chart: Chart) -> None:
    section = chart_section(chart)
    assert [item.name for item in section.items] == [
        "chart_drawn",
        "chart_comparisons",
        "chart_methods",
    ]


def test_numbers_of_layers_and_surfaces_are_readable(chart: Chart) -> None:
    _, methods = chart_tables(chart)
    [column] = [column for column in methods.columns if column.name == "layers"]
    shown = dict(
        zip(methods.frame["method"], map(column.text, methods.frame["layers"]), strict=True)
    )
    assert (shown["joint, 1 layer"], shown["AR(6)"]) == ("1", "n/a")
    assert counted_kind(1, "planted") == "1 planted texture (simulated)"
    assert counted_kind(2, "planted") == "2 planted textures (simulated)"
