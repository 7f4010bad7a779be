"""Findings and their weight."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum


class Weight(IntEnum):
    """How closely a finding concerns the question of the study, the closest first."""

    OVERALL = 0
    TEXTURES = 1
    SECONDARY = 2
    DESCRIPTIVE = 3


HEADINGS = {
    Weight.OVERALL: "Over all textures: the question of the study",
    Weight.TEXTURES: "Single textures that differ",
    Weight.SECONDARY: "Further findings",
    Weight.DESCRIPTIVE: "Described, not tested",
}


@dataclass(frozen=True)
class Outcome:
    """A finding in one sentence, with its weight."""

    weight: Weight
    sentence: str


def by_weight(outcomes: Iterable[Outcome]) -> dict[str, list[str]]:
    """Heading to sentences, highest weight first, in the order given; no empty heading."""
    groups: dict[str, list[str]] = {}
    for outcome in sorted(outcomes, key=lambda each: each.weight):
        groups.setdefault(HEADINGS[outcome.weight], []).append(outcome.sentence)
    return groups


def described(sentences: Iterable[str]) -> list[Outcome]:
    """These sentences as descriptive findings, without tests."""
    return [Outcome(Weight.DESCRIPTIVE, sentence) for sentence in sentences]
