"""Answers of one study from several set-ups, put together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import pandas as pd

from tactileq.analysis.answers.responses import SETUP_SEPARATOR, Responses
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown


def pool_setups(setups: Mapping[str, Responses]) -> Responses:
    """The answers of all set-ups, participants named after theirs.

    Parameters
    ----------
    setups : mapping of name to Responses
        One at least; each set-up runs the whole study with people of its own.

    Returns
    -------
    Responses
        Of as many participants as are planned for all set-ups together.

    Raises
    ------
    InputError
        For a name that cannot stand before a participant's, or set-ups that differ in their
        study, their models or in what was simulated.
    """
    first = next(iter(setups.values()))
    for name, one in setups.items():
        if not name or SETUP_SEPARATOR in name:
            raise InputError(
                f"expected a name without {SETUP_SEPARATOR} for a set-up, got {shown(name)}."
            )
        _check_alike(first, one, name)
    groups = {t: tuple(known) for one in setups.values() for t, known in one.equal.items()}
    planned = {
        task: replace(
            plan,
            participants=plan.participants * len(setups),
            sessions=plan.sessions * len(setups),
            trials=plan.trials * len(setups),
        )
        for task, plan in first.planned.items()
    }
    hashes = dict.fromkeys(sha256 for one in setups.values() for sha256 in one.plan.sha256)
    return replace(
        first,
        answers=_joined({name: one.answers for name, one in setups.items()}),
        training=_joined({name: one.training for name, one in setups.items()}),
        anchors=_joined({name: one.anchors for name, one in setups.items()}),
        left_out=_joined({name: one.left_out for name, one in setups.items()}),
        equal=groups,
        planned=planned,
        under_way={
            task: _named({name: one.under_way.get(task, ()) for name, one in setups.items()})
            for task in first.answers
        },
        dropped_out=_named({name: one.dropped_out for name, one in setups.items()}),
        setups=len(setups),
        plan=replace(first.plan, sha256=tuple(hashes)),
        verified=tuple(f"{name}: {line}" for name, one in setups.items() for line in one.verified),
        unverified=next((one.unverified for one in setups.values() if one.unverified), ""),
        warnings=tuple(
            f"{name}: {warning}" for name, one in setups.items() for warning in one.warnings
        ),
    )


def _named(people: Mapping[str, Iterable[str]]) -> frozenset[str]:
    """Participants of all set-ups, named after theirs."""
    return frozenset(
        f"{setup}{SETUP_SEPARATOR}{who}" for setup, all_ in people.items() for who in all_
    )


def named_after(setup: str, table: pd.DataFrame) -> pd.DataFrame:
    """The table with its participants named after their set-up; as it is without a name."""
    if not setup:
        return table
    return table.assign(
        participant_id=setup + SETUP_SEPARATOR + table["participant_id"].astype(str)
    )


def answers_at(setup: str, tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """The rows of one set-up with its own names of participants; all without a set-up's name."""
    if not setup:
        return dict(tables)
    before = setup + SETUP_SEPARATOR
    own = {t: table[table["participant_id"].str.startswith(before)] for t, table in tables.items()}
    return {
        task: table.assign(participant_id=table["participant_id"].str.removeprefix(before))
        for task, table in own.items()
    }


def _check_alike(first: Responses, other: Responses, name: str) -> None:
    same = (
        ("study", first.study_sha256, other.study_sha256),
        ("models", first.models, other.models),
        ("simulated participants", first.simulated_participants, other.simulated_participants),
        ("simulated rig", first.simulated_rig, other.simulated_rig),
    )
    for what, wanted, found in same:
        if wanted != found:
            raise InputError(
                f"expected set-ups that ran one study alike, got another {what} at {shown(name)}; "
                "analyse it by itself."
            )
    if other is not first and any(
        len(table) and table.equals(other.answers[task]) for task, table in first.answers.items()
    ):
        raise InputError(
            f"expected answers of its own at the set-up {shown(name)}, got those of another one; "
            "name each folder once."
        )


def _joined(tables: Mapping[str, Mapping[str, pd.DataFrame]]) -> dict[str, pd.DataFrame]:
    """The tables of each task beneath each other, participants named after their set-ups."""
    tasks = dict.fromkeys(task for of_setup in tables.values() for task in of_setup)
    joined = {}
    for task in tasks:
        here = {name: of_setup[task] for name, of_setup in tables.items() if task in of_setup}
        named = [named_after(name, table) for name, table in here.items() if len(table)]
        empty = next(iter(here.values()))
        joined[task] = pd.concat(named, ignore_index=True) if named else empty
    return joined
