"""Names in any script are drawn, or said to lack a font; the settings of Matplotlib stay."""

from __future__ import annotations

import io
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text

from tactileq.analysis.page import saving
from tactileq.analysis.page.saving import DEFAULT_FAMILY, missing_fonts, png_of, save_figure, svg_of

pytestmark = pytest.mark.filterwarnings("error")
NAMES = ("木材", "나무", "ひのき")


def figure_of(*names: str) -> Figure:
    figure = Figure(figsize=(3, 2), layout="constrained")
    ax = figure.subplots()
    ax.set_xticks(range(len(names)), names)
    return figure


def families(figure: Figure) -> set[str]:
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text)]
    return {family for text in texts for family in text.get_fontfamily()}


def test_chinese_korean_and_japanese_names_are_drawn():
    figure = figure_of(*NAMES)
    picture, lacking = png_of(figure, dpi=80)
    if lacking:
        pytest.skip("no font has these names; tools/system-packages installs fonts-wqy-microhei")
    assert len(families(figure)) > 1
    # Boxes for characters that are not there are all alike; these are not.
    drawn = [imread(io.BytesIO(png_of(figure_of(name), dpi=80)[0])) for name in ("木木", "材材")]
    assert picture.startswith(b"\x89PNG")
    assert drawn[0].shape == drawn[1].shape
    assert np.abs(drawn[0] - drawn[1]).sum() > 10


def test_names_that_matplotlib_can_draw_ask_for_no_other_font():
    figure = figure_of("wall paper", "Blech − µ")
    before = dict(mpl.rcParams)
    assert png_of(figure, dpi=80)[1] == ""
    assert families(figure) <= {DEFAULT_FAMILY, "sans-serif"}
    assert dict(mpl.rcParams) == before


@pytest.fixture
def only_matplotlibs_font(monkeypatch):
    """A machine without any other font."""
    path = saving.findfont(saving.FontProperties(family=DEFAULT_FAMILY))
    monkeypatch.setattr(saving, "_faces", lambda: ((DEFAULT_FAMILY, path, 0),))
    saving._families_for.cache_clear()
    yield
    saving._families_for.cache_clear()


@pytest.mark.usefixtures("only_matplotlibs_font")
def test_what_no_font_has_is_told_once_in_one_sentence(tmp_path: Path):
    assert png_of(figure_of("oak", "木木"), dpi=80)[1] == "木"
    with pytest.warns(UserWarning, match="fonts-noto-cjk") as told:
        save_figure(figure_of("木", "材木"), tmp_path / "x.png", dpi=80)
    assert [str(warning.message) for warning in told] == [missing_fonts("木材")]
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    assert "for 木 材, drawn as boxes; install one" in missing_fonts("木材")
    assert missing_fonts("") == ""


def course_of(name: str) -> Figure:
    """What names of clips, markers and images depend on, with a name."""
    figure = Figure(figsize=(4, 3), layout="constrained")
    ax = figure.subplots()
    ax.plot([0, 1, 2], [0, 1, 0], marker="o", clip_on=True)
    ax.imshow(np.eye(3), extent=(0, 2, 0, 1))
    ax.set_title(name)
    return figure


def test_svg_is_the_same_in_every_run():
    first, lacking = svg_of(course_of("wall paper"))
    assert lacking == ""
    assert svg_of(course_of("wall paper"))[0] == first
    assert svg_of(course_of("wallpaper"))[0] != first
    # A PNG that was drawn before may move the layout by a hair, always by the same.
    after_png = []
    for _ in range(2):
        figure = course_of("wall paper")
        png_of(figure, dpi=150)
        after_png.append(svg_of(figure)[0])
    assert after_png[0] == after_png[1]


def test_svg_needs_no_font_and_tells_no_date():
    root = ElementTree.fromstring(svg_of(course_of("µ − wall paper"))[0])
    kinds = {element.tag.rpartition("}")[2] for element in root.iter()}
    assert "path" in kinds
    assert not kinds & {"text", "date"}
    assert root.get("width") == "288pt"  # 4 inches


def test_svg_draws_other_scripts_as_a_png_does(only_matplotlibs_font):
    assert svg_of(figure_of("oak", "木木")) == (svg_of(figure_of("oak", "木木"))[0], "木")


def test_drawing_svg_leaves_the_settings_of_matplotlib():
    before = dict(mpl.rcParams)
    svg_of(figure_of("oak"))
    assert dict(mpl.rcParams) == before
