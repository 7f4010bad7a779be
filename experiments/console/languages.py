"""What participants read, in files of one language each (docs/method/protocols.md#languages)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Formatter
from typing import Any

from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tactileq.modeling.errors import shortened, shown
from tactileq.modeling.files.documents import read_toml

FOLDER = Path(__file__).with_name("texts")
COMPLETE = "en"  # the language of which every other one has the keys
PROOFREAD = "proofread"  # the only key of a file that is no text


def languages() -> tuple[str, ...]:
    """The languages that are shipped: names of files, such as "en" and "ja"."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.toml")))


@dataclass(frozen=True)
class Texts:
    """All texts of the console in one language.

    Parameters
    ----------
    by_key : mapping of key to text
        Keys have dots ("absolute.main.title"); texts have {places} for values.
    proofread : bool
        Whether a native speaker has read them, as their file states.
    """

    language: str
    by_key: Mapping[str, str]
    proofread: bool = True

    @staticmethod
    def load(language: str, own: Path | None = None) -> Texts:
        """The texts of a language: those that are shipped, a study's own ones in their place.

        Parameters
        ----------
        own : Path, optional
            A study's file: of a shipped language the texts that differ, of another one all.

        Raises
        ------
        InputError
            If there is no such language, or a file lacks a text, has one too many, or does not have
            the places of the English text.
        """
        shipped = FOLDER / f"{language}.toml"
        files = [file for file in (shipped if language in languages() else None, own) if file]
        if not files:
            raise InputError(
                f"expected a shipped language ({', '.join(languages())}), got {shown(language)}; "
                f"choose one, or name a file of its texts in the study file: texts = "
                f'"{language}.toml", which begins as a copy of {FOLDER / COMPLETE}.toml.'
            )
        complete, _ = _read(FOLDER / f"{COMPLETE}.toml")
        texts: dict[str, str] = {}
        proofread = True
        for file in files:
            found, stated = _read(file)
            _check(found, complete, file)
            texts |= found
            proofread = proofread if stated is None else stated
        if missing := [key for key in complete if key not in texts]:
            raise InputError(
                f"expected a text for {shortened(', '.join(missing))} in {files[-1]}, got none; "
                f"add what is missing ({len(missing)} of {len(complete)} texts), as in "
                f"{FOLDER / COMPLETE}.toml."
            )
        return Texts(language, texts, proofread)

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


def texts_of_study(study: Study) -> dict[str, Texts]:
    """The texts of each language of a study; a study of which a page lacks a text is refused.

    Raises
    ------
    InputError
        Naming the first language that is not there or lacks a text.
    """
    texts = {name: Texts.load(name, study.texts.get(name)) for name in study.languages}
    for of_language in texts.values():
        of_language.require(study.questions)
    return texts


def _read(file: Path) -> tuple[dict[str, str], bool | None]:
    """The texts of a file by their keys, and whether it states that they are proofread."""
    values = read_toml(file, "texts of a language")
    proofread = values.pop(PROOFREAD, None)
    if not isinstance(proofread, bool | None):
        raise InputError(
            f"expected true or false for {PROOFREAD} in {file}, got {shown(proofread)}; correct it."
        )
    texts: dict[str, str] = {}
    for key, value in _flat(values):
        if not _is_text(value):
            raise InputError(
                f"expected printable text for {key} in {file}, got {shown(value)}; put a text in "
                "quotes."
            )
        texts[key] = value
    return texts, proofread


def _flat(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def _is_text(value: object) -> bool:
    """Whether a page can show this: printable text, which may have several lines."""
    return isinstance(value, str) and value.strip() != "" and value.replace("\n", "").isprintable()


def _check(texts: Mapping[str, str], complete: Mapping[str, str], file: Path) -> None:
    """Refuse a text that no page shows, and one with other places than in English."""
    for key, content in texts.items():
        if key not in complete:
            raise InputError(
                f"expected texts that English has in {file}, got {shown(key)}; remove it, or "
                "correct its name."
            )
        wanted, found = _places(complete[key]), _places(content)
        if found != wanted:
            raise InputError(
                f"expected the placeholders {', '.join(sorted(wanted)) or 'none'} of English in "
                f"{key} of {file}, got {', '.join(sorted(found)) or 'none'}; correct it."
            )


def _places(content: str) -> set[str]:
    try:
        return {name for _, name, _, _ in Formatter().parse(content) if name is not None}
    except ValueError:  # a brace that is not closed: no place of any text
        return {"{"}
