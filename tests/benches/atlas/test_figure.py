"""The picture of the atlas and its page show what was examined, and say that it is simulated."""

from __future__ import annotations

import math

import pytest
from matplotlib.axes import Axes

from tactileq.analysis.page.drawing import BLACK
from tactileq.benches.atlas.case import Axis, Case
from tactileq.benches.atlas.edges import Examined, examine
from tactileq.benches.atlas.figure import COLOURS, MARKERS, figure_atlas, panels_of, plot_panel
from tactileq.benches.atlas.section import atlas_files, stability_section

SPEED = Axis(name="speed", unit="Hz", mild=1.0, severe=1000.0, default=2.0)


def value_itself(value: float, column: float, *, full: bool) -> float:
    return value


def made_up(family: str = "made up", *, method: str = "by decree", edge: float = 10.0) -> Case:
    return Case(
        family=family,
        method=method,
        ours=method == "by decree",
        axis=SPEED,
        figure="error",
        unit="dB",
        holds=10.0,
        degrades=100.0,
        measure=value_itself,
        theory=lambda column: edge,
        source="a book",
    )


def examined(*cases: Case) -> list[Examined]:
    return [examine(case, "", full=False) for case in cases]


def marks(ax: Axes, colour: str) -> list[float]:
    return [
        float(x) for line in ax.get_lines() if line.get_color() == colour for x in line.get_xdata()
    ]


def test_a_panel_shows_runs_edges_theory_and_default() -> None:
    found = examined(made_up(), made_up(method="theirs", edge=math.inf))
    ax = plot_panel(found)
    for verdict, value in (("holds", 1.0), ("degrades", 10**1.5), ("fails", 1000.0)):
        assert marks(ax, COLOURS[verdict]) == pytest.approx([value, value])
    assert len(set(MARKERS.values())) == len(set(COLOURS.values())) == 3
    assert marks(ax, BLACK) == [10.0, SPEED.severe]
    bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in ax.patches][:3]
    assert bars[0] == (1.0, found[0].holds_to)
    assert bars[1] == pytest.approx((found[0].holds_to, found[0].fails_from))
    assert bars[2] == pytest.approx((found[0].fails_from, 1000.0))
    assert ax.get_xlim() == (1.0, 1000.0)
    assert ax.get_xlabel() == "speed (Hz)"
    assert "SIMULATED" in [text.get_text() for text in ax.texts]
    labels = {label.get_text(): label.get_fontweight() for label in ax.get_yticklabels()}
    assert labels == {"by decree": "bold", "theirs": "normal"}


def test_panels_are_families_and_axes() -> None:
    found = examined(made_up(), made_up("other"), made_up(method="theirs"))
    assert [[one.case.method for one in panel] for panel in panels_of(found)] == [
        ["by decree", "theirs"],
        ["by decree"],
    ]
    figure = figure_atlas(found)
    assert len(figure.axes) == 2
    assert len(figure_atlas(examined(*(made_up(str(n)) for n in range(7)))).axes) == 7


def test_the_page_holds_picture_tables_and_what_is_to_come() -> None:
    found = examined(made_up(), made_up(method="theirs", edge=20.0))
    section = stability_section(found)
    told = [outcome.sentence for outcome in section.outcomes]
    assert told[0].startswith("1 of 1 defaults are at least a factor of 2 away")
    assert "(2 edges)" in told[-1]
    files = atlas_files(found, {"command": "tactileq stability"})
    for part in ("SIMULATED", "data:image/png;base64", "by decree", "wall"):
        assert part in files["atlas.html"].decode()
    assert "a book" in files["edges.tsv"].decode()
