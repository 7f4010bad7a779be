"""Data as they were stored, or a reason to go on: what analyze and verify share."""

from __future__ import annotations

import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from experiments.verification.verifying import Verified

MOST_SHOWN = 20


def print_data_differences(found: Verified) -> None:
    """A line for each difference in data, on standard error; of many the first ones."""
    print_differences([str(difference) for difference in found.differences])


def print_differences(sentences: Sequence[str]) -> None:
    """A line for each, on standard error; of many the first ones."""
    for sentence in sentences[:MOST_SHOWN]:
        print(f"differs: {sentence}", file=sys.stderr)
    if (more := len(sentences) - MOST_SHOWN) > 0:
        print(f"differs: {more} more", file=sys.stderr)


def require_verified(
    data: Path, *, without: Collection[str], unverified: str | None, named: str = ""
) -> Verified:
    """What verifying a data folder found, of all but some participants.

    Parameters
    ----------
    without : collection of str
        Participants (sub-01) who are left out.
    unverified : str, optional
        Reason to go on where something differs.
    named : str
        Of a set-up, what stands before a participant's name.

    Raises
    ------
    InputError
        If something differs and there is no reason to go on.
    """
    from experiments.verification.verifying import verify_data
    from modeling import InputError
    from modeling.errors import counted

    found = verify_data(data).without(without)
    if not found.differences:
        return found
    if unverified is not None:
        print_data_differences(found)
        return found
    first, *others = found.differences
    more = f" (and {counted(len(others), 'more difference')}; all: tactileq verify {data})"
    advice = "restore it from a copy"
    if not any(difference.place.startswith("sourcedata") for difference in found.differences):
        advice = f"make tables again with tactileq study status --data {data}"
    if first.participant:
        advice += f", leave the participant out with --exclude {named}{first.participant}=REASON"
    raise InputError(
        f"expected data as their sessions stored them, got a difference{more * bool(others)}: "
        f"{first}; {advice}, or go on with --unverified REASON, which the report says."
    )
