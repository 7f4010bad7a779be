"""What the window for visitors shows, without a window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactileq.experiments.feel.rigs import NO_HAND, HandNow, OutputNow
from tactileq.experiments.feel.textures import Texture
from tactileq.experiments.feel.view import (
    FeltCriterion,
    amplitude_range,
    felt_words,
    hand_words,
    level_words,
    model_now,
    output_words,
    place_of,
    short,
    spectrum_range,
    texture_now,
)
from tactileq.modeling import Renderer, TextureModel, Threshold, regressed, simplify
from tactileq.modeling.models.loading import Layered
from tactileq.modeling.perception.verdicts import CRITERIA, CriterionName
from tactileq.stimuli.planted.textures import CATALOGUE, planted_texture

FLAT = Threshold("flat", [10.0, 400.0], [0.1, 0.1], "decree", "none")


def lone_layers(*layers: tuple[float, float]) -> TextureModel:
    """A model of layers of 20 Hz, each of this frequency and amplitude (peak of equal power)."""
    k = np.tan(np.pi * 20 / 5000)
    frequency = np.array([f for f, _ in layers])
    gains = np.array([a for _, a in layers]) / np.sqrt(2 * k / (1 + k))
    grid = np.ones((2, 2, 1))
    return TextureModel(
        texture="layers",
        rate_hz=5000.0,
        speeds_mm_s=[50.0, 100.0],
        forces_n=[1.0, 2.0],
        noise_gains=np.zeros((2, 2)),
        frequencies_hz=grid * frequency,
        bandwidths_hz=grid * np.full(len(layers), 20.0),
        gains=grid * gains,
        level_sd_db=grid * np.zeros(len(layers)),
        estimator="planted",
    )


def at(speed: float, force: float) -> HandNow:
    return HandNow(speed_mm_s=speed, force_n=force)


def test_levels_of_known_layers() -> None:
    """Of gains, which stand above the threshold by `paper-gain` as they are."""
    gains = lone_layers((100.0, 0.2), (200.0, 0.1), (300.0, 0.05), (450.0, 0.05), (600.0, 0.2))
    k = np.tan(np.pi * 20 / 5000)
    model = replace(gains, gains=gains.gains * np.sqrt(2 * k / (1 + k)))
    gain = FeltCriterion(threshold=FLAT, criterion="paper-gain")
    layers = model_now(model, at(-60.0, 1.5), gain).layers
    assert layers.amplitude_g == pytest.approx([0.2, 0.1, 0.05, 0.05, 0.2])
    # Above the table's end a weak layer is not felt, and nothing is known of a strong one.
    levels = [20 * np.log10(2), 0.0, -20 * np.log10(2), -20 * np.log10(2), np.nan]
    assert layers.sensation_db == pytest.approx(levels, abs=1e-9, nan_ok=True)
    assert layers.felt[[0, 2, 3, 4]].tolist() == [True, False, False, False]
    assert layers.unknown.tolist() == [False, False, False, False, True]
    known_only = replace(gain, hold_above=False)
    layers = model_now(model, at(60.0, 1.5), known_only).layers
    assert layers.unknown.tolist() == [False, False, False, True, True]
    assert felt_words(layers).endswith(" of 5 layers, 2 unknown")


def test_the_change_of_power_by_a_lone_layer() -> None:
    """Its amplitude is that of the sinusoid of equal power; above the table nothing is known."""
    everywhere = replace(FLAT, frequency_hz=np.array([1e-6, 1e6]))
    now = at(60.0, 1.5)
    layers = model_now(lone_layers((100.0, 0.2)), now, FeltCriterion(threshold=everywhere)).layers
    assert layers.amplitude_g == pytest.approx([0.2])
    assert layers.sensation_db == pytest.approx([20 * np.log10(2)], abs=1e-4)
    assert layers.felt.tolist() == [True]
    layers = model_now(lone_layers((900.0, 0.2)), now, FeltCriterion(threshold=FLAT)).layers
    assert layers.unknown.tolist() == [True]


@pytest.mark.parametrize("threshold", ["codec", "pen-hold"])
@pytest.mark.parametrize("texture", ["canvas", "polyester", "PVC"])
def test_what_is_felt_is_what_simplify_says_of_that_condition(texture: str, threshold: str) -> None:
    model, table = planted_texture(texture), Threshold.shipped(threshold)
    yardstick = FeltCriterion(threshold=table)
    seen = set()
    for i, j in ((0, 0), (3, 2), (6, 6)):
        speed, force = float(model.speeds_mm_s[i]), float(model.forces_n[j])
        layers = model_now(model, at(speed, force), yardstick).layers
        alone = _condition(model, i, j)
        # Of one layer at a time: what `simplify` decides about several together stays out of it.
        for layer, verdict in enumerate(simplify(alone, table).layers):
            if " with layer" in verdict.reason:
                continue
            felt = "more than the threshold" in verdict.reason
            unknown = verdict.reason.startswith("no threshold known")
            assert bool(layers.felt[layer]) == felt
            assert bool(layers.unknown[layer]) == unknown
            if not unknown:
                assert layers.sensation_db[layer] == pytest.approx(verdict.distance_db)
            seen.add((felt, unknown))
    assert (True, False) in seen
    assert len(seen) > 1 or threshold == "pen-hold"


def _condition(model: TextureModel, i: int, j: int) -> TextureModel:
    """The model of one condition alone, whose levels are known exactly."""
    cut = {
        name: getattr(model, name)[i : i + 1, j : j + 1]
        for name in ("noise_gains", "frequencies_hz", "bandwidths_hz", "gains")
    }
    axes = {
        "speeds_mm_s": model.speeds_mm_s[i : i + 1],
        "forces_n": model.forces_n[j : j + 1],
    }
    rest = {"level_sd_db": np.zeros_like(cut["gains"])}
    marks = {name: np.zeros(0, dtype=bool) for name in ("inherited", "unresolved", "interpolated")}
    return replace(model, **axes, **cut, **rest, **marks)


@pytest.mark.parametrize("kind", ["grid", "regressed"])
def test_the_spectrum_is_the_response_that_is_rendered(kind: str) -> None:
    model: Layered = planted_texture("canvas")
    if kind == "regressed":
        model = regressed(model)
    now = model_now(model, at(-120.0, 1.3), FeltCriterion(threshold=FLAT))
    peq = model.peq(120.0, 1.3)
    assert now.density == pytest.approx(peq.response(now.frequency_hz) * np.sqrt(2 / 5000))
    assert (np.diff(now.frequency_hz) >= 0).all()
    assert np.isin(peq.frequencies_hz, now.frequency_hz).all()
    rendered = Renderer(model, seed=3).render(-120.0, 1.3, samples=100_000)[1000:]
    assert now.rms_g == pytest.approx(float(np.std(rendered)), rel=0.03)


def test_where_the_hand_is_on_the_grid() -> None:
    model = lone_layers((100.0, 0.2))
    places = {
        "inside": at(-60.0, 1.5),
        "above": at(100.1, 1.5),
        "below": at(49.0, 1.5),
        "rest": at(0.0, 1.5),
        "off": at(60.0, 0.0),
    }
    for place, hand in places.items():
        assert place_of(hand, model) == place
    assert place_of(at(60.0, 2.1), model) == "above"
    assert place_of(at(60.0, 0.9), model) == "below"
    assert place_of(at(float("nan"), 1.5), model) == "off"
    assert place_of(NO_HAND, model) == "off"


def test_a_hand_that_is_gone_feels_nothing() -> None:
    model = lone_layers((100.0, 0.2))
    gone = HandNow(speed_mm_s=60.0, force_n=1.5, there=False)
    now = model_now(model, gone, FeltCriterion(threshold=FLAT))
    assert now.rms_g == 0
    assert not now.layers.felt.any()
    assert level_words(float(now.layers.sensation_db[0])) == "silent"
    assert hand_words(gone) == "no hand"


@pytest.mark.parametrize("criterion", CRITERIA)
def test_axes_hold_all_textures_and_do_not_move(criterion: CriterionName) -> None:
    threshold = Threshold.shipped("codec")
    yardstick = FeltCriterion(threshold=threshold, criterion=criterion)
    textures = [Texture(full=planted_texture(name)) for name in CATALOGUE]
    low, high = spectrum_range(textures)
    assert high / low == pytest.approx(1000)
    bottom, top = amplitude_range(yardstick, textures)
    assert bottom < threshold.acceleration_g.min()
    assert threshold.acceleration_g.max() < top
    for texture in textures:
        full = texture.full
        loud = at(float(full.speeds_mm_s[-1]), float(full.forces_n[-1]))
        now = texture_now(texture, loud, yardstick)
        assert now.simplified is None
        assert now.full.density.max() <= high
        assert now.full.density.max() > low
        assert now.full.layers.amplitude_g.max() < top


def test_words_say_what_is_assumed_and_what_does_not_play() -> None:
    now = model_now(lone_layers((100.0, 0.2)), at(60.0, 1.5), FeltCriterion(threshold=FLAT))
    assert hand_words(HandNow(speed_mm_s=-61.0, force_n=1.5, force_assumed=True)) == (
        "61 mm/s   1.5 N (assumed)"
    )
    on_wall = hand_words(HandNow(speed_mm_s=80.0, force_n=0.74, depth_mm=1.26))
    assert {"0.7", "N", "1.3", "mm"} <= set(on_wall.split())
    level, silent = output_words(None, now, playing=True)
    assert level == "level: would be 0.141 g RMS"
    assert silent == "no sound device: nothing is played"
    assert output_words(None, now, playing=False)[0] == "level: would be 0.000 g RMS"
    output = OutputNow(rms_g=0.1, peak_g=0.4, limits=("peak", "RMS"), misses=3, latency_s=0.0053)
    assert output_words(output, now, playing=True) == (
        "level: 0.100 g RMS, 0.40 g peak",
        "limits touched: peak, RMS",
        "late blocks: 3",
        "latency of the output: 5 ms, as stated",
    )
    assert level_words(float("nan")) == "?"
    assert short("oak", 3) == "oak"
    assert short("oak wood", 4) == "oak…"
    assert level_words(-3.2) == "-3 dB"
