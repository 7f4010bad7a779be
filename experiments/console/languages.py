"""What participants read, in files of one language each (docs/method/protocols.md#languages)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Formatter
from typing import Any

from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.documents import read_toml

FOLDER = Path(__file__).with_name("texts")
COMPLETE = "en"  # the language of which every other one has the keys


def languages() -> tuple[str, ...]:
    """The languages that there are: names of files, such as "en" and "ja"."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.toml")))


@dataclass(frozen=True)
class Texts:
    """All texts of the console in one language.

    Parameters
    ----------
    by_key : mapping of key to text
        Keys have dots ("absolute.main.title"); texts have {places} for values.
    """

    language: str
    by_key: Mapping[str, str]

    @staticmethod
    def load(language: str) -> Texts:
        """The texts of one of `languages()`.

        Raises
        ------
        InputError
            If there is no such language, or if its file lacks a key, has one too many, or leaves
            a place out that the English text has.
        """
        if language not in languages():
            raise InputError(
                f"expected a language of {', '.join(languages())}, got {shown(language)}; choose "
                f"one, or add {language}.toml beside the others."
            )
        texts, complete = _read(language), _read(COMPLETE)
        missing = sorted(complete.keys() - texts.keys())
        if missing:
            _refuse(language, f"a text for {', '.join(missing)}", "got none; add what is missing")
        unknown = sorted(texts.keys() - complete.keys())
        if unknown:
            _refuse(language, "the texts that English has", f"got {', '.join(unknown)}; remove it")
        for key, content in texts.items():
            wanted, found = _places(complete[key]), _places(content)
            if found != wanted:
                expected = (
                    f"the placeholders {', '.join(sorted(wanted)) or 'none'} of English in {key}"
                )
                got = ", ".join(sorted(found)) or "none"
                _refuse(language, expected, f"got {got}; correct it")
        return Texts(language, texts)

    def of(self, key: str, **values: object) -> str:
        """The text of a key, with its places filled in; KeyError for an unknown key."""
        return self.by_key[key].format_map(values)

    def of_task(self, task: str, key: str, **values: object) -> str:
        """The text of a key, in the words of a task where it has its own."""
        own = f"{task}.{key.rpartition('.')[2]}"
        return self.of(own if own in self.by_key else key, **values)

    def question(self, question: Question) -> str:
        """What a participant is asked: the study's own text, or the shipped one."""
        return question.text.get(self.language) or self.of(f"question.{question.name}.text")

    def level(self, question: Question, level: str) -> str:
        """How an answer is shown: as the study says, else as it stands, or as shipped."""
        if self.language in question.levels_text:
            return question.levels_text[self.language][question.levels.index(level)]
        return level if question.text else self.of(f"question.{question.name}.{level}")

    def stamp(self, words: str) -> str:
        """Stamps, separated by commas, in this language; unknown ones as they stand."""
        parts = [word.strip() for word in words.split(",")]
        return " · ".join(self.by_key.get(f"stamp.{part}", part) for part in parts if part)

    def require(self, questions: Iterable[Question]) -> None:
        """Refuse a study whose questions cannot be asked in this language.

        Raises
        ------
        InputError
            Naming the first question without a text, or with an answer that has none.
        """
        for question in questions:
            name = question.name
            if question.text and self.language not in question.text:
                self._refuse_question(name, f"got it in {', '.join(question.text)} only")
            levels = () if self.language in question.levels_text else question.levels
            needed = [] if question.text else ["text", *levels]
            missing = [key for key in needed if f"question.{name}.{key}" not in self.by_key]
            if missing:
                self._refuse_question(name, f"got none for {', '.join(missing)}")

    def _refuse_question(self, name: str, got: str) -> None:
        raise InputError(
            f'expected the question "{name}" in the language "{self.language}", {got}; add '
            f'text.{self.language} = "…" to it in the study file.'
        )


def require_texts(study: Study) -> None:
    """Refuse a study of which a page has no text in one of its languages.

    Raises
    ------
    InputError
        Naming the first language that is not there or lacks a text.
    """
    for language in study.languages:
        Texts.load(language).require(study.questions)


def _read(language: str) -> dict[str, str]:
    file = FOLDER / f"{language}.toml"
    texts: dict[str, str] = {}
    _flatten(read_toml(file, "texts of a language"), "", texts)
    return texts


def _flatten(values: Mapping[str, Any], before: str, texts: dict[str, str]) -> None:
    for key, value in values.items():
        if isinstance(value, Mapping):
            _flatten(value, f"{before}{key}.", texts)
        else:
            texts[f"{before}{key}"] = str(value)


def _places(content: str) -> set[str]:
    try:
        return {name for _, name, _, _ in Formatter().parse(content) if name is not None}
    except ValueError:  # a brace that is not closed: no place of any text
        return {"{"}


def _refuse(language: str, expected: str, got: str) -> None:
    raise InputError(f'expected {expected} in the language "{language}", {got} in {language}.toml.')
