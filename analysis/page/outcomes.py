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


@dataclass(frozen=True)
class Outcome:
    """A finding in one sentence, with its weight."""

    weight: Weight
    sentence: str


def described(sentences: Iterable[str]) -> list[Outcome]:
    """These sentences as descriptive findings, without tests."""
    return [Outcome(Weight.DESCRIPTIVE, sentence) for sentence in sentences]
