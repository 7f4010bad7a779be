"""The order of a session drawn again, as the version that ran it drew it.

docs/method/verification.md#earlier-versions
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from tactileq.experiments.sessions.kept.log import plain
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.loop.order import draw_session
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import Occasion, Order, dealt, fisher_yates
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks import oddity, threshold

Drafts = list[dict[str, Any]]


def drawn_trials(manifest: SessionManifest, study: Study, task: Task) -> Drafts:
    """The trials of a session as study, seed and slot give them; plain values.

    Where those of this version are not the ones stored, and the session is of before logs had
    seals, they are those of the earlier draw that gives what is stored, if there is one.

    Raises
    ------
    InputError
        If the study has no such task, subject, session or slot.
    """

    def drawn(by: Task) -> Drafts:
        plan = draw_session(
            study, by, subject=manifest.subject, session=manifest.session, slot=manifest.slot
        )
        return [plain(trial.to_dict()) for trial in plan.trials]

    now, stored = drawn(task), [*manifest.trials]
    if manifest.after is not None or now == stored or task.name not in _EARLIER:
        return now
    before = drawn(replace(task, trials=_EARLIER[task.name]))
    return before if before == stored else now


def _oddity(occasion: Occasion, order: Order) -> Drafts:
    """Before 2026-11-23, 15 h UTC: the odd one's button balanced within texture and model alone."""
    positions = {
        pair: dealt(range(1, oddity.BUTTONS + 1), count, occasion.rng)
        for pair, count in Counter(order).items()
    }
    drafts = []
    for texture, odd in order:
        position = positions[texture, odd].pop()
        (same,) = set(occasion.models) - {odd}
        layout = [same] * oddity.BUTTONS
        layout[position - 1] = odd
        drafts.append(
            {"texture": texture, "model": odd, "layout": tuple(layout), "odd_position": position}
        )
    return drafts


def _threshold(occasion: Occasion, order: Order) -> Drafts:
    """Before 2026-11-24, 12 h UTC: one interval once more often at all frequencies."""
    frequencies_hz = (
        threshold.PRACTICE_HZ if occasion.phase == "training" else threshold.FREQUENCIES_HZ
    )
    repeats = occasion.study.plan_of("threshold").repeats
    pair = fisher_yates((1, 2), occasion.rng)
    intervals = {
        frequency_hz: fisher_yates([pair[n % 2] for n in range(repeats)], occasion.rng)
        for frequency_hz in frequencies_hz
    }
    return [
        {
            "texture": threshold.NONE,
            "model": threshold.NONE,
            "frequency_hz": frequency_hz,
            "interval": intervals[frequency_hz][number],
        }
        for number in range(repeats)
        for frequency_hz in fisher_yates(frequencies_hz, occasion.rng)
    ]


_EARLIER: dict[str, Callable[[Occasion, Order], Drafts]] = {
    "oddity": _oddity,
    "threshold": _threshold,
}
