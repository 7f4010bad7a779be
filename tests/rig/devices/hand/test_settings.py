"""Settings of the hand: what is refused."""

from __future__ import annotations

from typing import Any

import pytest

from tactileq.modeling import InputError
from tactileq.rig.devices.hand.settings import HandSettings
from tests.refusals import refused


@pytest.mark.parametrize(
    ("values", "expected", "got"),
    [
        ({"kind": "glove"}, ["kind", '"tablet"', '"scripted"'], "'glove'"),
        ({"kind": "mouse", "assumed_force_n": 1}, ["counts_per_mm", "mouse"], "none"),
        ({"kind": "mouse", "counts_per_mm": 40}, ["assumed_force_n", "mouse"], "none"),
        ({"kind": "window", "counts_per_mm": 4}, ["assumed_force_n", "window"], "none"),
        ({"kind": "tablet"}, ["assumed_force_n", "tablet"], "none"),
        ({"kind": "serial", "baud": 9600.5}, ["baud", 1200, 12000000], 9600.5),
        ({"kind": "serial", "filter_delay_s": 0}, ["filter_delay_s", 0.0005, 0.1], 0),
        ({"kind": "tablet", "pressure_points": ((0, 0),)}, "two", "((0, 0),)"),
        ({"kind": "tablet", "pressure_points": ((0, 0), (0, 1))}, "0 N", "((0, 0), (0, 1))"),
        ({"kind": "tablet", "pressure_points": ((0, 1), (1, 0.5))}, "0 N", "((0, 1), (1, 0.5))"),
        ({"kind": "tablet", "pressure_points": ((0, -1), (1, 0.5))}, "0 N", "((0, -1), (1, 0.5))"),
        ({"kind": "tablet", "pressure_points": 3}, "two", 3),
    ],
)
def test_refused_in_one_sentence(values: dict[str, Any], expected: object, got: object) -> None:
    with refused(InputError, expected=expected, got=got) as caught:
        HandSettings(**values)
    assert str(caught.value).count(". ") == 0
    assert str(caught.value).endswith(".")
