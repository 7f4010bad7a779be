"""Micro-controllers by name. What an operation costs them is measured in rendering's tests
(test_kernel_on_cortex_m.py)."""

from __future__ import annotations

from typing import Any

import pytest

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.scenes.microcontrollers import MicroController, _shipped
from tests.refusals import refused

NAMES = tuple(_shipped())


def test_a_micro_controller_has_the_numbers_of_its_data_sheet() -> None:
    small = MicroController.named("stm32l432")
    assert (small.core, small.clock_hz, small.memory_bytes) == ("Cortex-M4F", 80e6, 65_536)
    assert "DS11451" in small.source
    large = MicroController.named("teensy-4.1")
    assert (large.core, large.clock_hz, large.memory_bytes) == ("Cortex-M7", 600e6, 2**20)


def test_time_for_operations_is_the_clock_over_rate_and_cycles() -> None:
    made = MicroController("made", "Cortex-M4F", 100e6, 1024, 4.0, "nobody")
    assert made.operations_per_sample(5000.0) == 5000.0
    assert made.operations_per_sample(50_000.0) == 500.0


@pytest.mark.parametrize("name", NAMES)
def test_those_that_come_along_are_plausible(name: str) -> None:
    one = MicroController.named(name)
    assert one.name == name
    assert one.core in ("Cortex-M4F", "Cortex-M7")
    assert 50e6 <= one.clock_hz <= 1e9
    assert 32 * 1024 <= one.memory_bytes <= 2 * 2**20
    assert one.memory_bytes % 1024 == 0
    assert 1 <= one.cycles_per_operation <= 10
    assert len(one.source) > 30
    # A texture of four layers with updates every millisecond at 5 kHz takes 182.
    assert one.operations_per_sample(5000.0) > 182


@pytest.mark.parametrize("name", ["", "arduino", "STM32L432", "../stm32l432", "x" * 300, ["a"]])
def test_other_names_are_refused_with_those_there_are(name: Any) -> None:
    with refused(InputError, expected=NAMES, got=shown(name)) as told:
        MicroController.named(name)
    assert len(str(told.value)) < 400


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan"), 1e12])
def test_what_is_no_rate_is_refused(rate_hz: float) -> None:
    with refused(InputError, expected=["rate", "Hz"], got=shown(rate_hz)):
        MicroController.named(NAMES[0]).operations_per_sample(rate_hz)
