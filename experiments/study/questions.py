"""What a participant is asked before the first trial: the tables [[questions]] of a study."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
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
        Of a number; both or neither.
    levels : tuple of str
        Of a choice; two at least, or empty for a number.
    text : mapping of language to str
        The wording; empty for age, sex and handedness, whose wording is shipped.

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

    def __post_init__(self) -> None:
        object.__setattr__(self, "levels", tuple(self.levels))
        object.__setattr__(self, "text", dict(self.text))
        if not (isinstance(self.name, str) and re.fullmatch("[a-z][a-z0-9_]*", self.name)):
            raise InputError(
                "expected a name of small letters, digits and underscores for a question, got "
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

    @property
    def is_number(self) -> bool:
        """Whether it asks for a number, not for one of several levels."""
        return not self.levels

    def require_texts(self, languages: tuple[str, ...]) -> None:
        """Refuse a question of the study's own that lacks its wording in a language."""
        missing = [language for language in languages if language not in self.text]
        if missing and not (self.name in SHIPPED and not self.text):
            raise InputError(
                f"expected the question {self.name} in {', '.join(languages)}, got none in "
                f'{", ".join(missing)}; write text.{missing[0]} = "…".'
            )

    def to_dict(self) -> dict[str, Any]:
        """The question as plain values, as in a study file."""
        values = {
            "name": self.name,
            "least": self.least,
            "most": self.most,
            "levels": list(self.levels),
            "text": dict(self.text),
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
        return Question(**{**table, "text": text})
