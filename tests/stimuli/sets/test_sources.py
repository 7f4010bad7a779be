"""What a recipe's entries stand for."""

from __future__ import annotations

import numpy as np

from tactileq.stimuli.sets.recipe import TrajectoryEntry
from tactileq.stimuli.sets.sources import trajectory_of


def test_a_constant_entry_is_held() -> None:
    entry = TrajectoryEntry.constant(150, 1.5)
    assert entry.name == "150mms_1.5N"
    constant = trajectory_of(entry, duration_s=3.0)
    assert constant.duration_s == 3.0
    speed, force = constant.at(np.linspace(-1, 5, 7))
    assert set(speed) == {150.0}
    assert set(force) == {1.5}
