"""What the self-test measures, and when it says that a machine is too slow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.experiments.console.selftest import PRESSES, Timing, time_presentations, time_syncs
from tactileq.experiments.study.models import ModelSets
from tactileq.modeling import InputError
from tactileq.rig.shared.interface import Fault
from tests.refusals import refused


def test_the_99th_percentile_decides() -> None:
    timing = Timing(name="t", meaning="", milliseconds=np.arange(101.0).tolist(), limit_ms=99.0)
    assert (timing.median_ms, timing.p99_ms, timing.within) == (50.0, 99.0, True)
    slower = Timing(name="t", meaning="", milliseconds=[1.0] * 9 + [200.0], limit_ms=99.0)
    assert not slower.within


def test_presentations_are_timed_on_the_rigs_clock_and_the_rig_closed(
    rig: Any, models: ModelSets
) -> None:
    clock = [0.0]

    def present(model: object) -> float:
        clock[0] += 1.0
        return clock[0] - 0.97  # the first sample left 30 ms after the press

    rig.now_s = lambda: clock[0]
    rig.present_model = present
    timing = time_presentations(rig, [models.of("PVC", "full")])
    assert timing.milliseconds == pytest.approx([30.0] * PRESSES)
    assert timing.within
    assert not rig.opened


def test_a_rig_that_fails_meanwhile_is_told(rig: Any, models: ModelSets) -> None:
    rig.faults.append(Fault(0.1, "expected a card, got none; plug it in.", invalidates=True))
    with refused(InputError, names=["fault", rig.faults[-1].sentence]):
        time_presentations(rig, [models.of("PVC", "full")])
    assert not rig.opened


def test_the_disk_of_the_data_is_timed_and_left_as_it_was(tmp_path: Path) -> None:
    timing = time_syncs(tmp_path / "data")
    assert len(timing.milliseconds) == 200
    assert min(timing.milliseconds) > 0
    assert list((tmp_path / "data").iterdir()) == []
