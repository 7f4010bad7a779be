"""The line of a page that says what is needed to go on, and why something was refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tactileq.experiments.console.drawing import CONSOLE_GREY, CONSOLE_ORANGE


class Notice:
    """What is needed, in grey; in bold vermilion for who tries to go on without it.

    Parameters
    ----------
    remark : callable
        Makes a PsychoPy text in a colour, bold or not.
    keys : str
        Said where Enter has no button to press: which keys there are.
    """

    def __init__(self, remark: Callable[..., Any], *, keys: str) -> None:
        self.keys = keys
        self._remark = remark
        self._words, self._warns = "", False
        self._refusal = ""
        self._looks: tuple[str, bool] = ("", False)  # when drawn last
        self._drawn: Any = None

    def say(self, words: str, *, warns: bool = False) -> None:
        """Say this from now on; `warns` makes it look like a refusal."""
        self._words, self._warns = words, warns

    def refuse(self, words: str) -> None:
        """Say this instead, as a refusal, until this is called with nothing to say."""
        self._refusal = words

    def draw(self) -> None:
        """Draw the words, if there are any."""
        looks = (self._refusal, True) if self._refusal else (self._words, self._warns)
        if (
            looks != self._looks
        ):  # a text is made again when it changes: that takes PsychoPy a while
            self._looks = looks
            words, warns = looks
            color = CONSOLE_ORANGE if warns else CONSOLE_GREY
            self._drawn = self._remark(words, color=color, bold=warns) if words else None
        if self._drawn is not None:
            self._drawn.draw()
