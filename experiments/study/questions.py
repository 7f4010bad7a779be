"""What a participant is asked before the first trial: the tables [[questions]] of a study."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil, floor
from typing import Annotated, Any, ClassVar

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.kinds import Label, is_different, is_line

# Those whose wording the language files of the console hold.
SHIPPED = ("age", "sex", "handedness")
# What the console's page has room for: so many buttons, digits of a number to type.
MOST_LEVELS = 18
MOST_DIGITS = 6
# What is stored of who prefers not to answer, which everybody may: no study has to allow it. Of a
# question with this level it is one of the answers.
NOT_SAID = "not said"
# What the table of participants says of them anyway.
TAKEN = ("participant_id", "code", "slot", "language", "pilot", "simulated", "status")


def _is_free(name: str) -> bool:
    return is_line(name) and name not in TAKEN


@dataclass(frozen=True, kw_only=True)
class Question(FileSection):
    """A question that each participant is asked once: for a number, or for one of several levels.

    Raises
    ------
    InputError
        For a question that is neither for a number nor for a choice, or cannot be named so.
    """

    WHERE: ClassVar[str] = "[[questions]]"
    name: Annotated[
        str,
        key(
            "a column of participants.tsv",
            expected=f"lower-case letters, digits and underscores (and none of {', '.join(TAKEN)})",
            advice="rename it",
            pattern="^[a-z][a-z0-9_]*$",
            holds=_is_free,
        ),
    ]
    least: Annotated[float, key("least number, beside most", as_given=True)] | None = None
    most: (
        Annotated[float, key("largest number, a whole one as all answers", as_given=True)] | None
    ) = None
    levels: Annotated[
        tuple[Label, ...],
        key(
            f"of a choice, two to {MOST_LEVELS}, as the data name them",
            expected="a list of different levels, printable text in one line",
            holds=is_different,
            advice='write ["…", "…"]',
        ),
    ] = ()
    text: Annotated[
        dict[str, Label],
        key(
            f"the wording by language; of {', '.join(SHIPPED)} it is shipped",
            advice='text.en = "…"',
        ),
    ] = field(default_factory=dict)
    levels_text: Annotated[
        dict[str, Annotated[tuple[Label, ...], key(holds=is_different)]],
        key(
            "how the levels are shown, by language, in their order",
            expected="a table of lists of different printable texts in one line",
            advice='write levels_text.ja = ["…", "…"]',
        ),
    ] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        ends = [end for end in (self.least, self.most) if end is not None]
        if self.levels:
            good = len(self.levels) > 1 and not ends
        else:
            good = len(ends) == 2 and ends[0] < ends[1]
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
            if len(words) != len(self.levels):
                raise InputError(
                    f"expected {len(self.levels)} texts in levels_text.{language} of the question "
                    f"{self.name}, one for each level, got {len(words)}; give them in the order of "
                    "levels."
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

    @property
    def has_refusal(self) -> bool:
        """Whether not to answer is one of its own levels."""
        return NOT_SAID in self.levels

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
        """The question as plain values, as in a study file: what it says."""
        values = super().to_dict()
        return {name: value for name, value in values.items() if value not in (None, [], {})}
