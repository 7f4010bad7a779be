"""Data as they were stored, or a reason to go on: what analyze and verify share."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tactileq.experiments.sessions.kept.manifest import SessionManifest
    from tactileq.experiments.verification.verifying import Verified

MOST_SHOWN = 20


def print_data_differences(found: Verified) -> None:
    """A line for each difference in data, on standard error; of many the first ones."""
    print_differences([str(difference) for difference in found.differences])


def print_earlier(found: Verified, data: Path) -> None:
    """A note on files that an earlier version made, on standard error; nothing without any."""
    from tactileq.modeling.errors import counted

    if found.earlier:
        first, *others = found.earlier
        more = f" and {counted(len(others), 'more file')}" if others else ""
        print(
            f"note: an earlier version of tactileq made {first}{more}: the values are those of the "
            "logs, only texts that describe them are other ones; tactileq study status --data "
            f"{data} makes them again.",
            file=sys.stderr,
        )


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
    from tactileq.experiments.verification.verifying import verify_data
    from tactileq.modeling import InputError
    from tactileq.modeling.errors import counted

    found = verify_data(data).without(without)
    print_earlier(found, data)
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


def differing_models(name: str, place: Path, manifests: Sequence[SessionManifest]) -> Iterator[str]:
    """A sentence for each model and simplification in a folder that is not of those presented.

    Parameters
    ----------
    name : str
        Of the set whose models the folder holds.
    manifests : sequence of SessionManifest
        Of the sessions that presented them.

    Raises
    ------
    InputError
        If a file of models is none.
    """
    from tactileq.experiments.study.models import model_sha256
    from tactileq.modeling.files.places import matching
    from tactileq.modeling.models.loading import load_any_models
    from tactileq.modeling.perception.verdicts import ENDING, load_simplifications

    found = load_any_models(place)
    simplified = load_simplifications(place) if matching(place, f"*{ENDING}") else {}
    every = [item for one in manifests for item in one.models_sha256.items()]
    any_set = {(texture, sha256) for texture, hashes in every for sha256 in hashes.values()}
    for texture, sha256 in sorted({(texture, hashes[name]) for texture, hashes in every}):
        model, verdicts = found.get(texture), simplified.get(texture)
        if model is None or model_sha256(model) != sha256:
            got = "none" if model is None else "another"
            yield (
                f"{place}: expected the {name} model of {texture} that sessions presented, got "
                f"{got}"
            )
        if verdicts is not None and verdicts.model.sha256 != sha256:
            yield f"{place}: expected the simplification of that {texture}, got another"
        elif verdicts is not None and (texture, verdicts.full_sha256) not in any_set:
            yield (
                f"{place}: expected {texture} simplified from a model that was presented too, "
                "got it from another"
            )
