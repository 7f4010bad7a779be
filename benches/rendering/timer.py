"""One turn of everything that is timed: whatever slows the machine down slows all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import NamedTuple, TypeVar

import numpy as np

Name = TypeVar("Name")


class Turn(NamedTuple):
    """What is timed as a whole in each turn: a call, how many samples it makes, how often."""

    run: Callable[[], object]
    samples: int
    repeats: int = 1


def turn_ns(work: Mapping[Name, Turn]) -> dict[Name, float]:
    """One turn of everything: ns per sample, of what is repeated the best."""
    best = dict.fromkeys(work, np.inf)
    for name, turn in work.items():
        for _ in range(turn.repeats):
            start = perf_counter()
            turn.run()
            best[name] = min(best[name], 1e9 * (perf_counter() - start) / turn.samples)
    return best
