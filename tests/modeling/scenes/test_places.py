"""Where a bound counts: rounded outwards, all but the least visited places, slopes of the hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tactileq.modeling import InputError, TextureModel
from tactileq.modeling.scenes.hands import HandRange, distributed_hand
from tactileq.modeling.scenes.places import Places, places_of
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]


@pytest.fixture(scope="module")
def model(varied_model: ModelMaker) -> TextureModel:
    return varied_model(0, speeds_mm_s=(60.0, 150.0, 220.0, 300.0))


def counted(places: Places) -> tuple[list[float], list[float]]:
    rows, columns = places.counts.any(axis=1), places.counts.any(axis=0)
    return places.speeds_mm_s[rows].tolist(), places.forces_n[columns].tolist()


@pytest.mark.parametrize(
    ("speeds", "forces", "expected"),
    [
        ((60, 300), (0.5, 3), ([60, 150, 220, 300], [0.5, 1.5, 3])),
        ((150, 220), (1.5, 3), ([150, 220], [1.5, 3])),
        ((149, 221), (1, 1.4), ([60, 150, 220, 300], [0.5, 1.5])),
        ((150, 150), (0.5, 0.5), ([150], [0.5])),
        ((151, 151), (1, 1), ([150, 220], [0.5, 1.5])),
    ],
)
def test_a_range_is_rounded_outwards(
    speeds: tuple[float, float],
    forces: tuple[float, float],
    expected: tuple[list[float], list[float]],
    model: TextureModel,
) -> None:
    places = places_of(model, HandRange(speed_mm_s=speeds, force_n=forces))
    assert counted(places) == expected
    assert places.share.sum() == pytest.approx(1)
    assert (places.share > 0).tolist() == places.counts.tolist()


def test_all_that_was_recorded_is_the_whole_grid(model: TextureModel) -> None:
    ends = [(float(axis[0]), float(axis[-1])) for axis in (model.speeds_mm_s, model.forces_n)]
    written = places_of(model, HandRange(speed_mm_s=ends[0], force_n=ends[1]))
    named = places_of(model, HandRange(speed_mm_s="recorded", force_n="recorded"))
    for name in ("share", "counts", "speed_change_mm_s2", "force_change_n_s"):
        np.testing.assert_array_equal(getattr(named, name), getattr(written, name))
    assert (named.speed_range, named.force_range) == (written.speed_range, written.force_range)


def test_a_stroke_changes_fastest_where_it_is_slow(model: TextureModel) -> None:
    hand = HandRange(speed_mm_s=(60, 220), force_n=(0.5, 3), stroke_hz=1)
    places = places_of(model, hand)
    expected = 2 * np.pi * np.sqrt(np.maximum(220**2 - places.speeds_mm_s**2, 0))
    assert places.speed_change_mm_s2 == pytest.approx(np.repeat(expected[:, None], 3, axis=1))
    assert places.force_change_n_s == pytest.approx(np.full((4, 3), 2 * np.pi * 1.25))


def test_time_is_shared_among_the_nodes_around(model: TextureModel) -> None:
    hand = distributed_hand([105, 300], [1.5, 3], [0.8, 0.2])
    places = places_of(model, hand)
    expected = np.zeros((4, 3))
    expected[0, 1] = expected[1, 1] = 0.4
    expected[3, 2] = 0.2
    assert places.share == pytest.approx(expected)
    assert places.counts.tolist() == (expected > 0).tolist()


def test_what_is_visited_least_does_not_count(model: TextureModel) -> None:
    hand = distributed_hand([60, 150, 300], [0.5, 1.5, 3], [0.007, 0.986, 0.007])
    places = places_of(model, hand)
    assert int(places.counts.sum()) == 2
    assert places.counts[1, 1]


def test_a_hand_beyond_the_grid_is_refused_unless_it_hardly_ever_is(model: TextureModel) -> None:
    rarely = distributed_hand([100, 400], [1, 1], [0.995, 0.005])
    assert places_of(model, rarely).speed_range == (100, 300)
    for speed, force in ((400, 1), (100, 4)):
        often = distributed_hand([100, speed], [1, force], [0.9, 0.1])
        with refused(InputError, expected=["300 mm/s", "3 N", "varied 0", "99 %"], got="10%"):
            places_of(model, often)


def test_a_hand_below_the_grid_is_at_its_edge(model: TextureModel) -> None:
    places = places_of(model, distributed_hand([10, 100], [0.1, 1], [0.5, 0.5]))
    assert places.speed_range == (60, 100)
    assert places.force_range == (0.5, 1)
    assert places.share[0, 0] >= 0.5


def test_a_place_has_a_name(model: TextureModel) -> None:
    places = places_of(model, HandRange(speed_mm_s=(60, 300), force_n=(0.5, 3)))
    assert places.name(4) == "150 mm/s, 1.5 N"
