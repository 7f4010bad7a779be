"""Which layers may go in a scene: beside simplification, bands of actuators, sums, doubts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tactileq.modeling import InputError, TextureModel, simplify
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.perception.signs_of_rest import SignsOfRest
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.felt import kept_layers
from tactileq.modeling.scenes.hands import HandRange
from tactileq.modeling.scenes.places import places_of
from tactileq.modeling.scenes.scene import Actuator, Scene
from tactileq.stimuli.planted.textures import TEXTURES, planted_texture
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
CODEC = Threshold.shipped("codec")
NARROW_HZ = 0.3
HAND = HandRange(speed_mm_s=(100.0, 300.0), force_n=(1.0, 3.0))


def choices(model: TextureModel, scene: Scene) -> list[tuple[int, ...]]:
    places = places_of(model, scene.hand)
    groups, signs = own_peaks(model).groups, SignsOfRest.of_model(model)
    return kept_layers(model, scene, places, groups=groups, signs=signs)


def least(model: TextureModel, scene: Scene) -> tuple[int, ...]:
    return choices(model, scene)[0]


def at_threshold(
    make_model: ModelMaker, *layers: tuple[float, float], level_sd_db: float = 0.0
) -> TextureModel:
    """Layers at these (frequency, dB relative to the codec threshold).

    So narrow that each changes next to nothing at the place of another one.
    """
    unit = make_model(0.0, [(200.0, NARROW_HZ, 1.0)]).peq(100.0, 1.0).band_rms[0]
    made = [
        (f, NARROW_HZ, 10 ** (db / 20) * float(CODEC.at(f)) / np.sqrt(2) / unit) for f, db in layers
    ]
    return make_model(0.001, made, level_sd_db=level_sd_db)


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("margin_db", [0.0, 6.0])
def test_over_the_whole_grid_as_simplification_does(name: str, margin_db: float) -> None:
    model = planted_texture(name)
    whole = HandRange(speed_mm_s=(50.0, 350.0), force_n=(0.5, 3.5))
    simplified = simplify(model, CODEC, margin_db=margin_db)
    kept = tuple(v.layer - 1 for v in simplified.layers if v.verdict == "kept")
    assert least(model, Scene(name="whole", hand=whole, margin_db=margin_db)) == kept


def test_what_the_actuator_cannot_play_goes(make_model: ModelMaker) -> None:
    model = at_threshold(make_model, (60, 0.5), (200, 4), (380, 4))
    assert least(model, Scene(name="all", hand=HAND)) == (0, 1, 2)
    for band_hz, kept in (
        ((150.0, 300.0), (1,)),
        ((40.0, 300.0), (0, 1)),
        ((150.0, 480.0), (1, 2)),
    ):
        scene = Scene(name="band", hand=HAND, actuator=Actuator(band_hz=band_hz))
        assert least(model, scene) == kept


@pytest.mark.parametrize(("above_db", "goes"), [(0.1, False), (-0.1, True)])
def test_of_a_skirt_what_lies_in_the_band_is_judged(
    above_db: float, goes: bool, make_model: ModelMaker
) -> None:
    """By the midpoint rule, against the threshold at each frequency that is played."""
    model = make_model(0.0, [(60.0, 20.0, 1.0), (1000.0, 0.3, 1e-9)])
    frequency = np.arange(150.0, 300.0, 0.1) + 0.05
    response = model.peq(100.0, 1.0).response(frequency)
    power = 2 * np.sum((response / CODEC.at(frequency)) ** 2) * 0.1 / 2500
    level = np.sqrt(power) * 10 ** (-above_db / 20) * CODEC.acceleration_g
    scene = Scene(
        name="skirt",
        hand=HAND,
        actuator=Actuator(band_hz=(150.0, 300.0)),
        threshold=replace(CODEC, acceleration_g=level),
    )
    assert ((1,) in choices(model, scene)) == goes


def test_layers_that_are_felt_together_do_not_go_together(make_model: ModelMaker) -> None:
    model = at_threshold(make_model, (60, 3), (200, -2), (380, -2.5))
    scene = Scene(name="sum", hand=HAND)
    every = choices(model, scene)
    assert every == [(0, 1), (0, 2), (0, 1, 2)]  # of one size first the one that drops least
    quieter = at_threshold(make_model, (60, 3), (200, -4), (380, -4))
    assert least(quieter, scene) == (0,)


@pytest.mark.parametrize(("margin_db", "kept"), [(0.0, (0,)), (2.8, (0,)), (3.2, (0, 1))])
def test_a_margin_keeps_what_is_just_below(
    margin_db: float, kept: tuple[int, ...], make_model: ModelMaker
) -> None:
    model = at_threshold(make_model, (60, 3), (300, -3))
    assert least(model, Scene(name="margin", hand=HAND, margin_db=margin_db)) == kept


@pytest.mark.parametrize(("level_sd_db", "kept"), [(0.0, (0,)), (1.0, (0,)), (3.0, (0, 1))])
def test_what_may_be_felt_after_all_stays(
    level_sd_db: float, kept: tuple[int, ...], make_model: ModelMaker
) -> None:
    model = at_threshold(make_model, (60, 3), (300, -4), level_sd_db=level_sd_db)
    assert least(model, Scene(name="doubt", hand=HAND)) == kept


def test_what_is_felt_elsewhere_only_goes(make_model: ModelMaker) -> None:
    model = at_threshold(make_model, (60, 3), (300, -6))
    gains = model.gains.copy()
    gains[1, :, 1] *= 4  # felt at 300 mm/s
    model = replace(model, gains=gains)
    slow = replace(HAND, speed_mm_s=(100.0, 100.0))
    assert least(model, Scene(name="slow", hand=slow)) == (0,)
    assert least(model, Scene(name="all", hand=HAND)) == (0, 1)


def test_below_the_threshold_one_layer_stays(make_model: ModelMaker) -> None:
    model = at_threshold(make_model, (60, -20), (300, -30))
    assert len(least(model, Scene(name="weak", hand=HAND))) == 1


def test_where_no_threshold_is_known_a_layer_stays(make_model: ModelMaker) -> None:
    lowest = CODEC.valid_range_hz[0]
    model = make_model(0.01, [(lowest / 2, 2.0, 1e-5), (200.0, 2.0, 0.05)])
    assert all(0 in kept for kept in choices(model, Scene(name="unknown", hand=HAND)))


def test_a_layer_that_fills_anothers_shape_goes_with_it_or_not_at_all(
    make_model: ModelMaker,
) -> None:
    """A skirt below the threshold beside a loud peak: without it the peak would be another."""
    model = make_model(0.001, [(200.0, 40.0, 0.5), (205.0, 30.0, 0.3), (420.0, 20.0, 1e-5)])
    quiet = replace(CODEC, acceleration_g=10.0 * CODEC.acceleration_g)
    scene = Scene(name="fill", hand=HAND, threshold=quiet)
    assert all((0 in kept) == (1 in kept) for kept in choices(model, scene))


def test_arbitrary_units_are_refused(make_model: ModelMaker) -> None:
    model = make_model(0.1, [(200.0, 20.0, 1.0)], unit="arbitrary")
    with refused(InputError, names="planted", expected="g", got="'arbitrary'"):
        least(model, Scene(name="no unit", hand=HAND))


def test_what_is_dropped_is_counted_from_1(
    make_model: ModelMaker, compile_one: Callable[..., CompiledTexture]
) -> None:
    model = at_threshold(make_model, (60, -30), (300, 20))
    assert compile_one(model, Scene(name="count", hand=HAND)).dropped == (1,)
