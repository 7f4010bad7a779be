"""What is gathered while the sessions of a data folder are read one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from tactileq.analysis.answers.order import (
    Planned,
)
from tactileq.modeling import InputError

# Times to the millisecond: two participants do not have so many equal ones by chance.
FEWEST_TIMES = 3


class Gathered:
    """What is gathered while one session after the other is read."""

    def __init__(
        self, models: Mapping[str, Mapping[str, str]], leaving_out: frozenset[str]
    ) -> None:
        self.textures = frozenset(models)
        self.sets = tuple(next(iter(models.values()), {}))
        self.equal: dict[str, list[Sequence[str]]] = {}
        self.plans: dict[str, None] = {}  # in the order of the sessions
        self.warnings: list[str] = []
        self.leaving_out = leaving_out
        # Sessions of those who are left out that cannot be read, or have no answer, by task.
        self.unread: dict[str, list[dict[str, str]]] = {}
        self.under_way: dict[str, set[str]] = {}
        # Numbers of main trials that sessions of a task were planned with.
        self.main_trials: dict[str, set[int]] = {}
        self.pilots: set[tuple[str, str, str]] = set()
        self._whose: dict[str, str] = {}

    def add(self, sidecar: Mapping[str, object]) -> None:
        """The plan of a session, and the groups of equal models that it names."""
        if isinstance(plan := sidecar.get("PlanSHA256"), str):
            self.plans[plan] = None
        stated = sidecar.get("Identical")
        for texture, groups in stated.items() if isinstance(stated, Mapping) else ():
            known = self.equal.setdefault(str(texture), [])
            known += [tuple(group) for group in groups if tuple(group) not in known]

    def add_unread(self, task: str, participant: str, *, session: str) -> None:
        """A session of somebody who is left out, of which nothing more is known."""
        unread = {"participant_id": participant, "session": session}
        self.unread.setdefault(task, []).append(unread)

    def add_order(self, task: str, planned: Sequence[Planned]) -> None:
        """How many main trials a session was planned with."""
        main = sum(trial["phase"] == "main" for trial in planned)
        self.main_trials.setdefault(task, set()).add(main)

    def check_once(self, table: pd.DataFrame, what: str, *, path: Path) -> None:
        """Refuse answers that are those of another session to the last digit of every time."""
        if "response_time_s" not in table or table["response_time_s"].nunique() < FEWEST_TIMES:
            return
        text = table.to_csv(index=False)
        if text in self._whose:
            raise InputError(
                f"expected answers of its own in {path}, found those of {self._whose[text]}, with "
                "the same response times; leave one of the two sessions out."
            )
        self._whose[text] = what
