"""What participants read: complete in every language, and broken into lines as it is read."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tactileq.experiments.console import languages as module
from tactileq.experiments.console.drawing import NARROW_EM, NOT_FIRST, NOT_LAST, wrapped
from tactileq.experiments.console.languages import Texts, languages, texts_of_study
from tactileq.experiments.console.page_runner import REASONS
from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tests.refusals import refused


def test_every_language_has_every_text() -> None:
    assert {"de", "en", "ja"} <= set(languages())
    english = Texts.load("en").by_key
    for language in languages():
        texts = Texts.load(language).by_key
        assert texts.keys() == english.keys()
        assert all(text.strip() == text != "" for text in texts.values())


def test_every_page_that_is_announced_has_a_text() -> None:
    texts = Texts.load("en").by_key
    phases = ("training", "main", "closing")
    tasks = ("absolute", "relative", "oddity", "threshold")
    pages = [f"{task}.{phase}" for task in tasks for phase in phases]
    pages += [f"strokes.too_{how}" for how in ("slow", "fast", "light", "hard")]
    pages += ["strokes.beyond_edge"]
    for page in (*pages, "rest", "wait", "code", "known", "consent", "stopping"):
        assert {f"{page}.title", f"{page}.text"} <= texts.keys()
    assert {f"stopping.{reason}" for reason in REASONS} <= texts.keys()


def test_keys_are_told_without_numbers_that_a_page_may_lack() -> None:
    for language in languages():
        assert not any(map(str.isdigit, Texts.load(language).of("choice.keys"))), language


def test_who_is_asked_for_thresholds_is_told_to_hold_the_pen_still() -> None:
    told = (("en", "pen still"), ("ja", "ペンを動かさず"), ("de", "den Stift ruhig"))
    for language, pen in told:
        texts = Texts.load(language)
        for phase in ("training", "main"):
            assert pen in texts.of(f"threshold.{phase}.text")


def test_the_shipped_study_can_be_asked_in_every_language() -> None:
    for language in languages():
        texts = Texts.load(language)
        texts.require(Study.load().questions)
        for question in Study.load().questions:
            shown = [texts.question(question), *(texts.level(question, x) for x in question.levels)]
            assert len(set(shown)) == 1 + len(question.levels)


def test_a_language_that_is_not_there_is_refused() -> None:
    with refused(
        InputError, expected=["language", "en", "ja"], got=["'fr'", 'texts = "fr.toml"', "en.toml"]
    ) as told:
        Texts.load("fr")
    # Nothing is to be changed in what is installed.
    assert "beside" not in str(told.value)


@pytest.mark.parametrize(
    ("line", "expected", "got"),
    [
        ('b = "{n} Dinge"', "c.d", "none"),
        ('b = "{n} Dinge"\nc.d = "D"\ne = "E"', "English", "'e'"),
        ('b = "Dinge"\nc.d = "D"', ["n", "English", "b"], "none"),
        ('b = "{n} {m}"\nc.d = "D"', ["n", "English", "b"], "m, n"),
        ('b = "{n Dinge"\nc.d = "D"', ["n", "English", "b"], "{"),
        ('b = "{n} Dinge"\nc.d = 4', ["text", "c.d"], "4"),
        ('b = "{n} Dinge"\nc.d = " "', ["text", "c.d"], "' '"),
        ('proofread = "no"\nb = "{n} Dinge"\nc.d = "D"', ["true", "proofread"], "'no'"),
        ("b = ", "TOML", "something else"),
    ],
)
def test_a_file_that_is_no_language_is_refused(
    line: str, expected: object, got: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "en.toml").write_text('b = "{n} things"\n[c]\nd = "D"\n')
    own = tmp_path / "mine" / "xx.toml"
    own.parent.mkdir()
    own.write_text(line)
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    assert Texts.load("en").of("b", n=3) == "3 things"
    with refused(InputError, names=own, expected=expected, got=got) as told:
        Texts.load("xx", own)
    assert "\n" not in str(told.value)


def test_a_study_may_change_single_texts_of_a_shipped_language(tmp_path: Path) -> None:
    own = tmp_path / "de.toml"
    own.write_text('[rest]\ntitle = "Kurze Rast"\n', encoding="utf-8")
    texts, shipped = Texts.load("de", own), Texts.load("de")
    assert texts.of("rest.title") == "Kurze Rast" != shipped.of("rest.title")
    assert texts.by_key.keys() == shipped.by_key.keys()
    assert texts.of("rest.text") == shipped.of("rest.text")


def test_a_study_brings_a_language_of_its_own(tmp_path: Path) -> None:
    english = (module.FOLDER / "en.toml").read_text(encoding="utf-8")
    (tmp_path / "fr.toml").write_text(english.replace('"Consent"', '"Accord"'), encoding="utf-8")
    for texts in ("fr.toml", {"fr": "fr.toml"}):
        tables = {**Study.load().to_tables(), "languages": ["fr"], "texts": texts}
        study = Study.from_tables(tables, folder=tmp_path)
        assert texts_of_study(study)["fr"].of("consent.title") == "Accord"
    (tmp_path / "fr.toml").write_text('[consent]\ntitle = "Accord"\n', encoding="utf-8")
    with refused(InputError, names=tmp_path / "fr.toml", expected="keys", got="none"):
        texts_of_study(study)


def test_it_is_known_which_texts_no_native_speaker_has_read(tmp_path: Path) -> None:
    assert Texts.load("en").proofread
    assert not Texts.load("de").proofread
    own = tmp_path / "de.toml"
    own.write_text('rest.title = "Kurze Rast"')
    assert not Texts.load("de", own).proofread  # of the others nothing was said
    own.write_text("proofread = true")
    assert Texts.load("de", own).proofread


def test_a_question_without_a_translation_is_refused() -> None:
    german = Question(name="pets", levels=("0", "1"), text={"de": "Haustiere?"})
    with refused(InputError, expected=['"pets"', '"ja"'], got=["de", "text.ja"]):
        Texts.load("ja").require([german])
    with refused(InputError, expected=['"pets"', '"en"'], got=["text, 0, 1", "text.en"]):
        Texts.load("en").require([Question(name="pets", levels=("0", "1"))])
    with refused(InputError, expected=['"sex"', '"en"'], got="m"):
        Texts.load("en").require([Question(name="sex", levels=("female", "m"))])
    own = Question(name="sex", levels=("f", "m"), text={"en": "Your sex?"})
    texts = Texts.load("en")
    texts.require([own])
    assert (texts.question(own), texts.level(own, "m")) == ("Your sex?", "m")


def test_levels_are_shown_in_the_words_of_the_language_else_as_they_stand() -> None:
    pets = Question(
        name="pets",
        levels=("none", "one"),
        text={"en": "Pets?", "ja": "ペットは?"},
        levels_text={"ja": ("いない", "いる")},
    )
    told = {
        language: [Texts.load(language).level(pets, level) for level in pets.levels]
        for language in ("en", "ja")
    }
    assert told == {"en": ["none", "one"], "ja": ["いない", "いる"]}
    sex = Question(name="sex", levels=("female", "x"), levels_text={"en": ("Woman", "Neither")})
    texts = Texts.load("en")
    texts.require([sex])
    assert [texts.level(sex, level) for level in sex.levels] == ["Woman", "Neither"]
    with refused(InputError, expected=['"sex"', '"ja"'], got="x"):
        Texts.load("ja").require([sex])


def test_a_study_in_a_language_without_texts_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped = Study.load()
    assert list(texts_of_study(shipped)) == ["en", "ja"]
    with refused(InputError, expected=["language", "en", "ja"], got="'fr'"):
        texts_of_study(replace(shipped, languages=("en", "fr")))
    for language in ("en", "ja"):
        texts = (module.FOLDER / f"{language}.toml").read_text(encoding="utf-8")
        (tmp_path / f"{language}.toml").write_text(texts, encoding="utf-8")
    with (tmp_path / "en.toml").open("a") as file:
        file.write('\n[new]\ntitle = "New"\n')
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    texts_of_study(replace(shipped, languages=("en",)))
    with refused(InputError, expected=["new.title", "ja.toml"], got="none"):
        texts_of_study(shipped)


def test_stamps_are_translated() -> None:
    assert Texts.load("en").stamp("pilot, simulated rig") == (
        "Pilot: these answers do not count · Simulated rig"
    )
    assert Texts.load("ja").stamp("simulated rig") == "模擬装置"
    assert Texts.load("ja").stamp("") == ""


# --- Lines of Japanese ----------------------------------------------------------------------


def test_a_line_ends_before_a_phrase() -> None:
    assert wrapped("二つの表面を比べてください", 8) == "二つの表面を\n比べてください"
    assert wrapped("短い文です。", 8) == "短い文です。"
    assert wrapped("一行目\n二行目", 20) == "一行目\n二行目"


JAPANESE = st.text(
    st.sampled_from("二表面振動のをはがくてっょーアカ、。「」（）Tab12 "), max_size=60
)


@given(JAPANESE, st.integers(8, 30))
@example("111「 1、、、、", 8)
def test_no_line_is_too_long_or_breaks_a_rule(content: str, width: int) -> None:
    lines = wrapped(content, width).split("\n")
    assert "".join(lines).replace(" ", "") == content.replace(" ", "")
    for before, after in pairwise(lines):
        assert before[-1:] not in NOT_LAST
        assert after[:1] not in NOT_FIRST
    # A line is longer only where its first part that may be broken off is.
    for line in map(str.rstrip, lines):
        cuts = [i for i in range(1, len(line)) if may_break(line[:i], line[i])]
        assert width_em(line) <= width or all(width_em(line[:cut]) > width for cut in cuts)


def width_em(line: str) -> float:
    return sum(1 if ord(letter) > 0x2E80 else NARROW_EM for letter in line)


def may_break(before: str, after: str) -> bool:
    if after in NOT_FIRST or before.rstrip()[-1:] in NOT_LAST or after == " ":
        return False
    return before[-1] == " " or not (before[-1] + after).isascii()
