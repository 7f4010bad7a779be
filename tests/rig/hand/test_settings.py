"""Settings of the hand: there and back, and what is refused."""

from __future__ import annotations

import json
from typing import Any

import pytest

from modeling import InputError
from rig.hand.settings import HandSettings

TABLET = HandSettings(kind="tablet", pressure_points=((0.0, 0.0), (0.5, 1.0), (1.0, 4.0)))


@pytest.mark.parametrize(
    "settings",
    [
        TABLET,
        HandSettings(kind="mouse", counts_per_mm=40, assumed_force_n=1.0, grab=True),
        HandSettings(kind="serial", device="/dev/ttyACM0", baud=500000),
        HandSettings(kind="scripted", script="hold", speed_mm_s=-80),
    ],
)
def test_there_and_back_by_json(settings: HandSettings) -> None:
    assert HandSettings.from_dict(json.loads(json.dumps(settings.to_dict()))) == settings


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, "expected the kind of hand, got none"),
        ({"kind": "glove"}, 'to be "tablet" or "mouse" or "serial" or "window" or "scripted"'),
        ({"kind": "mouse", "assumed_force_n": 1}, "expected counts_per_mm of a mouse"),
        ({"kind": "mouse", "counts_per_mm": 40}, "expected assumed_force_n of a mouse"),
        ({"kind": "window", "counts_per_mm": 4}, "expected assumed_force_n of a window"),
        ({"kind": "tablet"}, "expected assumed_force_n of a tablet"),
        ({"kind": "serial", "baud": 9600.5}, "expected a whole number from 1200"),
        ({"kind": "serial", "filter_delay_s": 0}, "for filter_delay_s"),
        ({"kind": "serial", "speed": 3}, "got speed; correct the spelling"),
        ({"kind": "tablet", "pressure_points": [[0, 0]]}, "at least two points"),
        ({"kind": "tablet", "pressure_points": [[0, 0], [0, 1]]}, "expected rising pressure"),
        ({"kind": "tablet", "pressure_points": [[0, 1], [1, 0.5]]}, "expected rising pressure"),
        ({"kind": "tablet", "pressure_points": [[0, -1], [1, 0.5]]}, "expected rising pressure"),
        ({"kind": "tablet", "pressure_points": 3}, "at least two points"),
    ],
)
def test_refused_in_one_sentence(values: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        HandSettings.from_dict(values)
    assert str(refused.value).count(". ") == 0
    assert str(refused.value).endswith(".")
