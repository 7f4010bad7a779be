"""What a participant is asked before the first trial: the tables [[questions]] of a study."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import ceil, floor
from typing import Any

from experiments.study.tables import (
    as_list,
    as_table,
    require_different,
    require_keys,
    require_label,
)
from modeling import InputError
from modeling.checks import check_keys, is_number
from modeling.errors import shown

# Those whose wording the language files of the console hold.
SHIPPED = ("age", "sex", "handedness")
# What the console's page has room for: so many buttons, digits of a number to type.
MOST_LEVELS = 18
MOST_DIGITS = 6
# What the table of participants says of them anyway.
TAKEN = ("participant_id", "code", "slot", "language", "pilot", "simulated", "status")


@dataclass(frozen=True, kw_only=True)
class Question:
    """One question: for a number, or for one of several levels.

    Parameters
    ----------
    name : str
        Small letters, digits and underscores; a column of participants.tsv.
    least, most : float, optional
        Of a whole number, 0 … 999 999; both or neither.
    levels : tuple of str
        Of a choice, 2 … 18, as the data name them; empty for a number.
    text : mapping of language to str
        The wording; empty for age, sex and handedness, whose wording is shipped.
    levels_text : mapping of language to tuple of str
        How the levels are shown, in their order; where they are not given, as the data name them.

    Raises
    ------
    InputError
        For a question that is neither for a number nor for a choice, or cannot be named so.
    """

    name: str
    least: float | None = None
    most: float | None = None
    levels: tuple[str, ...] = ()
    text: Mapping[str, str] = field(default_factory=dict)
    levels_text: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "levels", tuple(self.levels))
        object.__setattr__(self, "text", dict(self.text))
        shown_as = {language: tuple(words) for language, words in self.levels_text.items()}
        object.__setattr__(self, "levels_text", shown_as)
        if not (isinstance(self.name, str) and re.fullmatch("[a-z][a-z0-9_]*", self.name)):
            raise InputError(
                "expected a name of lower-case letters, digits and underscores for a question, got "
                f"{shown(self.name)}; rename it."
            )
        if self.name in TAKEN:
            raise InputError(
                f"expected a question of another name than {', '.join(TAKEN)}, got {self.name}; "
                "rename it."
            )
        self._check_answers()

    def _check_answers(self) -> None:
        for level in self.levels:
            require_label(f"a level of the question {self.name}", level)
        require_different(f"levels of the question {self.name}", self.levels)
        ends = [end for end in (self.least, self.most) if end is not None]
        if self.levels:
            good = len(self.levels) > 1 and not ends
        else:
            good = len(ends) == 2 and all(map(is_number, ends)) and ends[0] < ends[1]
        if not good:
            raise InputError(
                f"expected least and most, or two levels or more, for the question {self.name}, "
                f"got {shown(self.least)}, {shown(self.most)} and {shown(list(self.levels))}; "
                "give the one or the other."
            )
        if self.levels:
            self._check_levels()
        else:
            self._check_range(*ends)

    def _check_levels(self) -> None:
        if len(self.levels) > MOST_LEVELS:
            raise InputError(
                f"expected at most {MOST_LEVELS} levels, which one page has room for, of the "
                f"question {self.name}, got {len(self.levels)}; put some of them together, or ask "
                "for a number with least and most."
            )
        for language, words in self.levels_text.items():
            where = f"levels_text.{language} of the question {self.name}"
            for word in words:
                require_label(where, word)
            require_different(where, words)
            if len(words) != len(self.levels):
                raise InputError(
                    f"expected {len(self.levels)} texts in {where}, one for each level, got "
                    f"{len(words)}; give them in the order of levels."
                )

    def _check_range(self, least: float, most: float) -> None:
        if self.levels_text:
            raise InputError(
                f"expected levels for the levels_text of the question {self.name}, got least and "
                "most; remove levels_text."
            )
        if not (least >= 0 and most < 10**MOST_DIGITS and ceil(least) <= floor(most)):
            raise InputError(
                f"expected a range of whole numbers from 0 to {10**MOST_DIGITS - 1} for the "
                f"question {self.name}, got {shown(least)} to {shown(most)}; ask in another unit, "
                "or give levels."
            )

    @property
    def is_number(self) -> bool:
        """Whether it asks for a number, not for one of several levels."""
        return not self.levels

    def require_texts(self, languages: tuple[str, ...]) -> None:
        """Refuse a question of the study's own that lacks its wording in a language.

        Likewise where its levels do; in the first language they are shown as they stand.
        """
        missing = [language for language in languages if language not in self.text]
        if missing and not (self.name in SHIPPED and not self.text):
            raise InputError(
                f"expected the question {self.name} in {', '.join(languages)}, got none in "
                f'{", ".join(missing)}; write text.{missing[0]} = "…".'
            )
        missing = [language for language in languages[1:] if language not in self.levels_text]
        if self.text and self.levels and missing:
            example = ", ".join(['"…"'] * len(self.levels))
            raise InputError(
                f"expected the levels of the question {self.name} in {', '.join(languages)}, got "
                f"none in {', '.join(missing)}; write levels_text.{missing[0]} = "
                f"[{example}]."
            )

    def to_dict(self) -> dict[str, Any]:
        """The question as plain values, as in a study file."""
        values = {
            "name": self.name,
            "least": self.least,
            "most": self.most,
            "levels": list(self.levels),
            "text": dict(self.text),
            "levels_text": {name: list(words) for name, words in self.levels_text.items()},
        }
        return {name: value for name, value in values.items() if value not in (None, [], {})}

    @staticmethod
    def from_dict(values: object) -> Question:
        """A question from its table in a study file.

        Raises
        ------
        InputError
            For unknown or missing keys, or values of other kinds.
        """
        table = as_table(values, where="[[questions]]", example="[[questions]] above its keys")
        check_keys(table, tuple(f.name for f in fields(Question)), where="[[questions]]")
        require_keys(table, ("name",), where="[[questions]]")
        name = shown(table["name"])
        if "levels" in table:
            table["levels"] = as_list(
                table["levels"], where=f"levels of {name}", example='levels = ["…", "…"]'
            )
        text = as_table(table.get("text", {}), where=f"text of {name}", example='text.en = "…"')
        for language, words in text.items():
            require_label(f"text.{language} of {name}", words)
        levels_text = as_table(
            table.get("levels_text", {}),
            where=f"levels_text of {name}",
            example='levels_text.ja = ["…", "…"]',
        )
        for language, words in levels_text.items():
            levels_text[language] = as_list(
                words,
                where=f"levels_text.{language} of {name}",
                example=f'levels_text.{language} = ["…", "…"]',
            )
        return Question(**{**table, "text": text, "levels_text": levels_text})
