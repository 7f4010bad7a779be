"""Numbers of screens, without one; and every page, in every language and at two sizes."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from fontTools.ttLib import TTFont

from tactileq.experiments.console import drawing, screens
from tactileq.experiments.console.drawing import BLUE, CONSOLE_ORANGE
from tactileq.experiments.console.languages import Texts, languages
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
SCRIPT = Path(__file__).with_name("screens_of_all_pages.py")
SIZES = ((1024, 768), (1920, 1080))
Box = list[float]
UNFOCUSED = ("consent", "known", "stop-first", "stop")  # of which the keys are told at the foot
READABLE = 4.5  # contrast of text with what is behind it (WCAG 2.2, success criterion 1.4.3)


def test_the_only_screen_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(screens, "_screen_count", lambda: 1)
    screens.check_screen(0)
    with refused(InputError, expected=["screen", 0], got=1):
        screens.check_screen(1)


@pytest.mark.parametrize(
    ("screen", "size"),
    [
        ((1920, 1080), (1280, 800)),
        ((1280, 800), (1280, 800)),
        ((1024, 768), (1024, 768)),
        ((1366, 640), (1280, 640)),
        ((768, 1024), (768, 576)),
    ],
)
def test_a_window_fits_its_screen(screen: tuple[int, int], size: tuple[int, int]) -> None:
    assert screens.size_within((1280, 800), screen) == size


def apart(a: Box, b: Box) -> bool:
    return a[2] <= b[0] + 1 or b[2] <= a[0] + 1 or a[3] <= b[1] + 1 or b[3] <= a[1] + 1


def within(a: Box, b: Box) -> bool:
    return a[0] >= b[0] - 1 and a[1] >= b[1] - 1 and a[2] <= b[2] + 1 and a[3] <= b[3] + 1


def faults(page: dict[str, Any], window: Box) -> list[str]:
    """Texts that overlap, that a shape's edge cuts, and what reaches beyond the window."""
    texts, shapes = page["texts"], page["shapes"]
    found = [f"{words!r} is cut" for words, box in texts if not within(box, window)]
    found += [f"shape {box} is cut" for box in shapes if not within(box, window)]
    for index, (words, box) in enumerate(texts):
        overlapping = [other for other, there in texts[:index] if not apart(box, there)]
        found += [f"{words!r} overlaps {other!r}" for other in overlapping]
        crossed = [s for s in shapes if not apart(box, s) and not within(box, s)]
        found += [f"{words!r} crosses the edge of {shape}" for shape in crossed]
    return found


def test_faults_of_a_page_are_found() -> None:
    window = [-100.0, -100.0, 100.0, 100.0]
    good = {"texts": [["a", [0, 0, 9, 9]], ["b", [10, 0, 19, 9]]], "shapes": [[-1, -1, 20, 20]]}
    assert faults(good, window) == []
    bad = {"texts": [["a", [0, 0, 9, 9]], ["b", [5, 5, 19, 102]]], "shapes": [[-1, -1, 7, 120]]}
    assert faults(bad, window) == [
        "'b' is cut",
        "shape [-1, -1, 7, 120] is cut",
        "'a' crosses the edge of [-1, -1, 7, 120]",
        "'b' overlaps 'a'",
        "'b' crosses the edge of [-1, -1, 7, 120]",
    ]


WINDOWS = {
    f"{language}:{w}x{h}": [-w / 2, -h / 2, w / 2, h / 2]
    for language in languages()
    for w, h in SIZES
}


@pytest.fixture
def pages(display: str, once_per_run: Any) -> list[dict[str, Any]]:
    """All languages one after another in one process: PsychoPy takes seconds to start."""

    def made(folder: Path) -> list[dict[str, Any]]:
        shown = subprocess.run(
            [sys.executable, str(SCRIPT), "-", *WINDOWS],
            env={**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=500,
        )
        assert shown.returncode == 0, shown.stderr[-2000:]
        return [json.loads(line) for line in shown.stdout.splitlines()]

    return once_per_run("pages-of-the-console", made)


def test_every_letter_is_in_the_type_that_it_is_set_in() -> None:
    """Else a page would show an empty box in its place."""
    latin, bold = (set(TTFont(font).getBestCmap()) for font in drawing._latin_fonts())
    (japanese,) = (set(TTFont(font).getBestCmap()) for font in drawing._japanese_fonts())
    for language in languages():
        for content in Texts.load(language).by_key.values():
            there = japanese if any(map(drawing._is_wide, content)) else latin & bold
            missing = {letter for letter in content if ord(letter) not in there}
            assert not missing, (language, content)


def test_every_page_stands_in_the_docs_under_its_title(pages: list[dict[str, Any]]) -> None:
    text = (ROOT / "docs/participants.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[([^]]*)\]\(participants/(\S+)\.png\)", text)
    expected = {
        page["page"]: page["texts"][1][0]  # below the line on a pilot
        for page in pages
        if page["screen"] == "en:1024x768"
    }
    assert len(shown) == len(expected) > 30
    assert {name: title for title, name in shown} == expected
    there = (ROOT / "docs/participants").glob("*.png")
    assert {picture.stem for picture in there} == set(expected)


def test_on_no_page_is_anything_cut_or_covered(pages: list[dict[str, Any]]) -> None:
    assert len(pages) == len(WINDOWS) * len({page["page"] for page in pages})
    assert {page["screen"] for page in pages} == set(WINDOWS)
    for page in pages:
        where = (page["screen"], page["page"])
        assert faults(page, WINDOWS[page["screen"]]) == [], where
        told = [words for words, _ in page["texts"]]
        assert tells_nothing(told), where
        if page["page"] in UNFOCUSED:
            assert Texts.load(page["screen"][:2]).of("keys") in told, where
        if page["page"] in ("consent", "known"):  # neither answer looks like one that was given
            assert not {BLUE, CONSOLE_ORANGE} & set(page["fills"]), where
        # Between two pixels thin strokes fade.
        off = [abs(value - round(value)) for place in page["places"] for value in place]
        assert max(off) < 1e-6, where


def test_every_text_of_every_page_has_the_contrast_that_reading_needs(
    pages: list[dict[str, Any]],
) -> None:
    for page in pages:
        for (words, _), colors in zip(page["texts"], page["colors"], strict=True):
            assert contrast(*colors) >= READABLE, (page["screen"], page["page"], words, colors)


def test_contrast_is_that_of_the_guidelines() -> None:
    assert contrast("#000000", "#FFFFFF") == pytest.approx(21.0)
    assert contrast("#767676", "#FFFFFF") == pytest.approx(4.54, abs=0.005)  # their known example
    assert contrast("#FFFFFF", "#767676") == contrast("#767676", "#FFFFFF")


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def luminance(color: str) -> float:
    """Relative luminance of an sRGB colour (WCAG 2.2)."""
    parts = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_trials_for_practice_are_marked_and_no_others(pages: list[dict[str, Any]]) -> None:
    trials = [page for page in pages if page["page"].startswith(("rate", "choose"))]
    assert {"rate-practice", "choose-7-practice"} <= {page["page"] for page in trials}
    for page in trials:
        mark = Texts.load(page["screen"][:2]).of("practice")
        marked = mark in [words for words, _ in page["texts"]]
        assert marked is page["page"].endswith("-practice"), page["page"]


def test_what_is_refused_is_said_on_the_page(pages: list[dict[str, Any]]) -> None:
    ages = {"least": 18, "most": 99}
    keys = {
        "question-age-below": "question.too_small",
        "question-age-above": "question.too_large",
        "question-sex-needed": "question.choose",
        "rate-needed": "absolute.needed",
        "choose-7-unfelt": "choice.feel_first",
        "choose-interval-again": "threshold.felt_now",
    }
    said = 0
    for page in pages:
        if (key := keys.get(page["page"])) is not None:
            words = Texts.load(page["screen"][:2]).of(key, number=2, **ages)
            colors = [
                color
                for (shown, _), (color, _) in zip(page["texts"], page["colors"], strict=True)
                if shown.replace("\n", "") == words
            ]
            assert CONSOLE_ORANGE in colors, (page["screen"], page["page"])
            said += 1
    assert said == len(keys) * len(WINDOWS)


def tells_nothing(texts: list[str]) -> bool:
    """Whether neither a texture, nor a set of models, nor a tray is named."""
    study = Study.load()
    hidden = [*study.textures, *study.models, "tray", "トレイ", "model", "モデル"]
    words = " ".join(texts).lower()
    return texts != [] and not any(name.lower() in words for name in hidden)
