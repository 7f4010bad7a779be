"""Situations with known truth, by which procedures are judged that ask about people.

How large is the mean effect of those who attend, and which share of them has an effect outside
the bounds? The mechanisms are those of ratings and choices (sliders with ends, the triangular
decision, evidence for seven textures), not the assumptions of a procedure under test.
`held_out` has more, by other mechanisms.
"""

from __future__ import annotations

from collections.abc import Mapping

from tactileq.benches.validation.people.choices import CHOICE_SITUATIONS, ODDITY_SITUATIONS
from tactileq.benches.validation.people.drawn import (
    CHOICE_KIND,
    ODDITY_KIND,
    RATING_KIND,
    DrawnStudies,
    Situation,
)
from tactileq.benches.validation.people.ratings import RATING_SITUATIONS

__all__ = ["CHOICE_KIND", "ODDITY_KIND", "RATING_KIND", "SITUATIONS", "DrawnStudies", "Situation"]

# By "kind: name"; each is called with a generator and (studies, people).
SITUATIONS: Mapping[str, Situation] = {
    f"{situation.kind}: {name}": situation
    for situations in (RATING_SITUATIONS, ODDITY_SITUATIONS, CHOICE_SITUATIONS)
    for name, situation in situations.items()
}
