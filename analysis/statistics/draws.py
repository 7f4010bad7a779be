"""Random numbers of the statistics: each task has its own."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.seeds import generator


def generators(rng: np.random.Generator) -> dict[str, np.random.Generator]:
    """A generator for each task, so that draws for one do not change the results of another.

    Parameters
    ----------
    rng : Generator
        Asked for one number. As new tasks stand at the end of `ANSWER_TABLES`, they change nothing
        of the others.
    """
    seed = int(rng.integers(2**63))
    return {task: generator(seed, place) for place, task in enumerate(ANSWER_TABLES)}
