"""Caveats of a verdict: what remains of it where equality must not be concluded.

docs/method/statistics.md#withheld
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from tactileq.analysis.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    WITHIN_BOUNDS,
    verdict,
)

WITHHELD = "equivalence withheld"
BOUNDS_WITHHELD = "different, bounds withheld"
# What remains of a word of equality where equality must not be concluded.
_WITHOUT_EQUALITY = {
    EQUIVALENT: WITHHELD,
    WITHIN_BOUNDS: BOUNDS_WITHHELD,
}
EQUALITY = tuple(_WITHOUT_EQUALITY)
WITHOUT_EQUALITY = (WITHHELD, BOUNDS_WITHHELD)
DIFFERENCES = (DIFFERENT, WITHIN_BOUNDS, BOUNDS_WITHHELD)
SHOWN, NOT_TESTED = "shown", "sensitivity not tested"
INTERIM = "interim, no verdict"
NOT_CONVERGED = "no verdict, sampler not converged"


@dataclass(frozen=True, kw_only=True)
class Caveats:
    """Doubts about a verdict, whatever the tests show.

    Parameters
    ----------
    identical : collection of str
        Textures whose two models are the same: controls, described but never tested.
    highest_share_at_ends : float
        Above it equivalence is not concluded.
    sensitivity : str
        `SHOWN` where the data show that participants told different surfaces apart;
        `NOT_TESTED` where nothing in them could show it; else how they failed.
    unfinished : bool
        Whether participants or sessions are missing.
    """

    identical: Collection[str] = ()
    highest_share_at_ends: float = 1.0
    sensitivity: str = NOT_TESTED
    unfinished: bool = False

    def doubt(self, share_at_ends: float) -> str:
        """Why equivalence must not be concluded, whatever the tests show; empty where it may be.

        docs/method/statistics.md#withheld

        Parameters
        ----------
        share_at_ends : float
            Share of the answers at an end of their scale; NaN of a measure that has none.
        """
        if self.sensitivity != SHOWN:
            return self.sensitivity
        if share_at_ends > self.highest_share_at_ends:
            return (
                f"{share_at_ends:.0%} of the ratings lie at an end of the scale (at most "
                f"{self.highest_share_at_ends:.0%} were planned)"
            )
        return ""

    def verdict(
        self, p_difference: float, p_equivalence: float, *, share_at_ends: float = np.nan
    ) -> str:
        """The verdict of two tests, without equivalence where there is doubt.

        Parameters
        ----------
        p_difference, p_equivalence : float
            As for `equivalence.verdict`.
        share_at_ends : float
            As for `doubt`.
        """
        return self.allowed(verdict(p_difference, p_equivalence), share_at_ends=share_at_ends)

    def allowed(self, word: str, *, share_at_ends: float = np.nan) -> str:
        """A verdict as it may be said: without equality where there is doubt.

        Parameters
        ----------
        share_at_ends : float
            As for `doubt`.
        """
        if self.unfinished:
            return INTERIM
        return _WITHOUT_EQUALITY.get(word, word) if self.doubt(share_at_ends) else word
