"""Labels of trays that name what is in them: refused before a study runs, readable afterwards."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tactileq.experiments.study.study import Study
from tactileq.experiments.study.trays import require_trays
from tactileq.modeling import InputError
from tests.refusals import refused


def with_tray(label: str) -> Study:
    """The shipped study with this label for the tray of canvas."""
    study = Study.load()
    return replace(study, trays={**study.trays, "canvas": label})


@pytest.mark.parametrize(
    ("label", "named"),
    [
        ("canvas", "canvas"),
        ("CANVAS", "canvas"),
        ("mdf", "MDF"),  # another one's
        ("ＭＤＦ", "MDF"),
        ("Wallpaper", "wall paper"),
        ("wall-paper", "wall paper"),
        ("the WALL_PAPER", "wall paper"),
        ("wall", None),
        ("tray of canvas, left", "canvas"),
        ("canvases", None),
        ("H", None),
        ("○", None),
    ],
)
def test_a_label_that_names_a_texture_is_refused(label: str, named: str | None) -> None:
    study = with_tray(label)
    if named is None:
        require_trays(study)
        return
    with refused(InputError, names=["'canvas'", "[trays]"], got=[f"'{label}'", f"'{named}'"]):
        require_trays(study)


def test_a_study_of_earlier_data_with_such_labels_is_read() -> None:
    study = with_tray("canvas")
    assert Study.from_dict(study.to_dict()).trays["canvas"] == "canvas"


def test_the_shipped_study_reveals_nothing() -> None:
    require_trays(Study.load())
