"""Rules that a study may break for a stated reason, which is recorded."""

from __future__ import annotations

from collections.abc import Callable

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown


class Overrides:
    """The rules that were overridden, and the reason.

    Parameters
    ----------
    reason : str, optional
        Printable text; without one nothing is allowed.
    tell : callable, optional
        Called with each rule that is broken, in one sentence.

    Raises
    ------
    InputError
        For a reason that says nothing.
    """

    def __init__(
        self, reason: str | None = None, *, tell: Callable[[str], None] | None = None
    ) -> None:
        if reason is not None and not (reason.strip() and reason.isprintable()):
            raise InputError(
                f"expected a reason in words after --override, got {shown(reason)}; say why."
            )
        self._reason = reason.strip() if reason else ""
        self._tell = tell
        self.recorded: list[dict[str, str]] = []

    def allow(self, what: str, sentence: str) -> None:
        """Override a rule, which is recorded once.

        Parameters
        ----------
        what : str
            Which rule, in a word or two.
        sentence : str
            Expected, got and what to do otherwise, as of any bad input, without its full stop.

        Raises
        ------
        InputError
            Without a reason: the sentence, and how to give one.
        """
        if not self._reason:
            raise InputError(f"{sentence}, or go on with --override REASON, which is recorded.")
        record = {"what": what, "reason": self._reason}
        if record not in self.recorded:
            self.recorded.append(record)
            if self._tell is not None:
                self._tell(f"overridden ({what}): {sentence}.")
