"""Many streams side by side give the bits of one at a time."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import tactileq.modeling.rendering.many
from tactileq.modeling import (
    ARModel,
    InputError,
    Limits,
    Renderer,
    TextureModel,
    regressed,
    render_many,
)
from tactileq.modeling.arrays import Floats
from tactileq.modeling.engines import SWITCH
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.modeling.rendering.many import WIDTHS, lib, rendered
from tactileq.modeling.vibrators.compensation import Compensation
from tactileq.stimuli.planted.textures import TEXTURES, planted_texture
from tests.refusals import refused

HERE = Path(__file__).parent
KERNEL_FOLDER = Path(tactileq.modeling.rendering.many.__file__).parent
RATES_HZ = (5000.0, 48000.0)
LIMITS = Limits(peak=0.9, rms=0.4, rms_window_s=0.05, duration_s=0.02, pause_s=0.004)
ANY_VALUE = (
    st.floats(width=64)
    | st.floats(-400, 400)
    | st.sampled_from([0.0, -0.0, 5e-324, np.nan, np.inf])
)
ANY_HAND = arrays(np.float64, st.tuples(st.just(2), st.integers(0, 150)), elements=ANY_VALUE)


def wild_model(layers: int, seed: int = 0) -> TextureModel:
    """Layers all over the legal range, from corner to corner of the grid, gains of either sign."""
    rng = np.random.default_rng(seed)
    shape = (3, 4, layers)
    return TextureModel(
        texture="wild",
        rate_hz=5000.0,
        speeds_mm_s=[20.0, 150.0, 351.3],
        forces_n=[0.3, 1.1, 2.2, 3.5],
        noise_gains=rng.uniform(0, 0.2, shape[:2]),
        frequencies_hz=np.exp(rng.uniform(0, np.log(2450), shape)),
        bandwidths_hz=np.exp(rng.uniform(np.log(0.1), np.log(2250), shape)),
        gains=rng.normal(0, 1, shape),
        level_sd_db=np.zeros(shape),
        estimator="planted",
    )


def compiled_for(model: TextureModel, update_s: float) -> TextureModel:
    note = CompiledFor("planted", "", "", {}, update_s, False)
    return replace(model, compiled_for=note)


def ar_model() -> ARModel:
    """The same everywhere."""
    shape = (2, 2)
    frequencies = np.linspace(0.3, 2.8, 6)
    return ARModel(
        texture="all-pole",
        rate_hz=5000.0,
        speeds_mm_s=[50.0, 350.0],
        forces_n=[0.5, 2.0],
        line_spectral_frequencies=np.broadcast_to(frequencies, (*shape, 6)),
        gains=np.full(shape, 0.1),
        level_sd_db=np.zeros(shape),
    )


def compensation(rate_hz: float) -> Compensation:
    return Compensation(rate_hz=rate_hz, frequency_hz=80.0, bandwidth_hz=60.0, height=3.0)


def strokes(lengths: list[int], rate_hz: float = 5000.0) -> list[Hand]:
    """Back and forth, over the grid's edges, with lift-offs."""
    hands = []
    for number, length in enumerate(lengths):
        time_s = np.arange(length) / rate_hz
        speed = (150 + 40 * number) * np.sin(2 * np.pi * (3 + number / 3) * time_s + number)
        force = 1.5 + 3 * np.sin(2 * np.pi * (5 - number / 7) * time_s)
        force[length // 3 : length // 3 + 20] = np.nan
        hands.append(Hand(speed, force))
    return hands


def assert_same_bits(
    models: list[TextureModel], hands: list[Hand], *, lanes: int, **options: Any
) -> None:
    """Side by side in vectors of `lanes`, and one by one: bits, signs of zeros and counters."""
    noise = [(number % 3, number) for number in range(len(models))]
    found = rendered(models, hands, noise, options=options, lanes=lanes)
    for model, hand, (seed, stream), (signal, counters) in zip(
        models, hands, noise, found, strict=True
    ):
        alone = Renderer(model, seed=seed, stream=stream, **options)
        assert signal.tobytes() == alone.render(*hand).tobytes()
        assert counters == alone.counters


@pytest.fixture(params=WIDTHS)
def lanes(request: pytest.FixtureRequest) -> int:
    """A width; where this processor lacks it, the widest that it has."""
    assert lib is not None
    return min(request.param, lib.tq_widest())


@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_bits_are_equal_whatever_the_hands_do(data: st.DataObject) -> None:
    """1 to 17 streams of 0 to 9 layers, each with its own length."""
    hands = data.draw(st.lists(ANY_HAND, min_size=1, max_size=17))
    most = data.draw(st.sampled_from([0, 1, 3, 9]))
    layers = [data.draw(st.integers(max(0, most - 1), most)) for _ in hands]
    models = [wild_model(count, number % 3) for number, count in enumerate(layers)]
    rate_hz = data.draw(st.sampled_from(RATES_HZ))
    assert_same_bits(
        models,
        [Hand(*hand) for hand in hands],
        lanes=data.draw(st.sampled_from(WIDTHS[: WIDTHS.index(lib.tq_widest()) + 1])),
        rate_hz=rate_hz,
        update_samples=data.draw(st.integers(1, 70) | st.none()),
        limits=data.draw(st.sampled_from([None, LIMITS])),
        compensation=data.draw(st.sampled_from([None, compensation(rate_hz)])),
    )


@pytest.mark.parametrize("rate_hz", [5000.0, 5500.0, 48000.0])
def test_bits_are_equal_on_strokes(lanes: int, rate_hz: float) -> None:
    """Logarithmic tables, regressions, mixed layers; lengths around those of chunks."""
    models = [planted_texture(texture) for texture in TEXTURES]
    models += [regressed(planted_texture("canvas"), by=by) for by in ("conditions", "centroid")]
    models += [wild_model(3), *[models[0]] * 3]
    hands = strokes([700, 1, 64, 63, 65, 640, 0, 900, 200, 300, 5, 1200, 1201], rate_hz)
    assert_same_bits(models, hands, lanes=lanes, rate_hz=rate_hz)
    assert_same_bits(models, hands, lanes=lanes, rate_hz=rate_hz, update_samples=1)


def test_bits_are_equal_where_all_hands_hold(lanes: int) -> None:
    """Held, in motion until slopes have died away, held beyond the grid, at rest, lifted."""
    models = [wild_model(9), regressed(wild_model(9), by="conditions"), wild_model(9, 1)]
    ramp = np.linspace(90, 400, 300)
    speed = np.concatenate([np.full(300, 90.0), ramp, np.full(900, 400.0), np.zeros(60)])
    lifted = np.full(60, np.nan), np.full(80, 10.0)
    hands = [
        Hand(np.concatenate([factor * speed, *lifted]), np.full(1700, 2.0 - factor))
        for factor in (1.0, 0.7, -0.9)
    ]
    for update_samples in (1, 5, 48):
        assert_same_bits(models, hands, lanes=lanes, update_samples=update_samples)


def test_bits_are_equal_with_limits_and_compensation(lanes: int) -> None:
    """Every counter counts, in streams that end at different times."""
    models = [wild_model(9), regressed(wild_model(9), by="conditions"), *[wild_model(3)] * 3]
    hands = strokes([3000, 100, 2000, 2999, 1])
    limits = Limits(peak=0.9, rms=0.4, rms_window_s=0.05, duration_s=0.1, pause_s=0.004)
    options = {"limits": limits, "compensation": compensation(5000.0)}
    assert_same_bits(models, hands, lanes=lanes, **options)
    found = rendered(models, hands, [(0, 0)] * 5, options=options, lanes=lanes)
    for name in vars(found[0][1]):
        assert sum(getattr(counters, name) for _, counters in found) > 0, name


@pytest.mark.parametrize("rate_hz", [None, 5000.0])
def test_order_and_kinds_do_not_matter(rate_hz: float | None) -> None:
    """By the public name: AR models between layered ones, models of different rates."""
    models = [wild_model(2), ar_model(), planted_texture("PVC"), wild_model(2, 1), ar_model()]
    if rate_hz is None:
        models.append(planted_texture("PVC").at_rate(8000.0))
    hands = strokes([400, 300, 500, 450, 20, 333][: len(models)])
    seeds, streams = [5, 4, 3, 2, 1, 0][: len(models)], range(len(models))
    found = render_many(models, hands, seeds=seeds, streams=streams, rate_hz=rate_hz)
    for model, hand, seed, stream, signal in zip(models, hands, seeds, streams, found, strict=True):
        alone = Renderer(model, seed=seed, stream=stream, rate_hz=rate_hz)
        assert signal.tobytes() == alone.render(*hand).tobytes()


def test_models_of_several_scenes_keep_their_own_update_intervals() -> None:
    intervals = (1, 5, 20, 20, 80)
    models = [compiled_for(wild_model(2, seed), n / 5000) for seed, n in enumerate(intervals)]
    hands = strokes([400, 300, 500, 450, 333])
    found = render_many(models, hands, seeds=range(5))
    for seed, (model, hand, signal) in enumerate(zip(models, hands, found, strict=True)):
        alone = Renderer(model, seed=seed, update_samples=intervals[seed])
        assert signal.tobytes() == alone.render(*hand).tobytes()


def test_streams_are_0_by_default_and_nothing_gives_nothing() -> None:
    model, hand = wild_model(1), strokes([200])[0]
    one, other = render_many([model] * 2, [hand] * 2, seeds=[7, 8])
    assert np.array_equal(one, Renderer(model, seed=7).render(*hand))
    assert np.array_equal(other, Renderer(model, seed=8).render(*hand))
    assert render_many([], [], seeds=[]) == []


def test_lists_integers_and_views_are_hands() -> None:
    model, wide = wild_model(2), np.arange(100.0).reshape(50, 2)
    hands = [([100, 200, 300], [1, 2, 3]), (wide[:, 0], wide[::-1, 1])]
    found = render_many([model] * 2, hands, seeds=[0, 0])
    for hand, signal in zip(hands, found, strict=True):
        assert np.array_equal(signal, Renderer(model).render(*hand))


@pytest.mark.parametrize("cores", [1, 2])
def test_number_of_cores_does_not_matter(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tactileq.modeling.rendering.many, "usable_cores", lambda: cores)
    models, hands = [wild_model(3)] * 40, strokes([300] * 40)
    found = render_many(models, hands, seeds=range(40))
    for seed in (0, 17, 39):
        assert np.array_equal(found[seed], Renderer(models[0], seed=seed).render(*hands[seed]))


@pytest.mark.parametrize("without", ["kernel", "vectors"])
def test_without_compiled_parts_the_bits_stay(
    without: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    models, hands = [wild_model(3), planted_texture("PVC")], strokes([150, 200])
    expected = render_many(models, hands, seeds=[1, 2], limits=LIMITS)
    if without == "kernel":
        monkeypatch.setenv(SWITCH, "1")
    else:
        monkeypatch.setattr(tactileq.modeling.rendering.many, "lib", None)
    found = render_many(models, hands, seeds=[1, 2], limits=LIMITS)
    assert [signal.tobytes() for signal in found] == [signal.tobytes() for signal in expected]


@pytest.mark.parametrize("baseline", [False, True])
def test_bits_are_equal_in_c_with_and_without_wide_vectors(baseline: bool, tmp_path: Path) -> None:
    """In every width that the processor has, and as on processors of another kind."""
    options = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-trapping-math"]
    options += ["-DTQ_BASELINE"] * baseline
    program = tmp_path / "many_builds"
    source = HERE / "many_builds.c"
    command = ["gcc", *options, f"-I{KERNEL_FOLDER}", source, "-o", program, "-lm"]
    subprocess.run(command, check=True)
    run = subprocess.run([program], check=True, capture_output=True, text=True)
    *widths, different = map(int, run.stdout.split())
    widest = 2 if baseline else lib.tq_widest()
    assert tuple(widths) == WIDTHS[: WIDTHS.index(widest) + 1]
    assert different == 0


HAND: tuple[Floats, Floats] = (np.zeros(3), np.zeros(3))


@pytest.mark.parametrize(
    ("arguments", "expected", "got"),
    [
        ({"seeds": [0]}, "seeds", ["2 models", "2 hands", "1 seed"]),
        ({"streams": [0, 1, 2]}, "streams", ["2 seeds", "3 streams"]),
        ({"hands": [HAND]}, "hands", ["2 models", "1 hand"]),
        ({"hands": [HAND, (np.zeros(3), np.zeros(4))]}, "signal 1", ["(3,)", "(4,)"]),
        ({"hands": [HAND, (1.0, 1.0)]}, "signal 1", "()"),
        ({"hands": [(*HAND, np.zeros(3)), HAND]}, "signal 0", 3),
        ({"hands": [HAND, (["fast"] * 3, np.zeros(3))]}, ["speed", "numbers"], "fast"),
        ({"seeds": [0, -1]}, ["seed", 0], -1),
        ({"streams": [0, 0.5]}, ["stream", 0], 0.5),
        ({"rate_hz": 1000.0}, "rate", 1000),
        ({"update_samples": 0}, ["updates", 1], 0),
        ({"compensation": compensation(8000.0)}, ["compensation", "5000 Hz"], "8000 Hz"),
    ],
)
def test_bad_input_is_refused(arguments: dict[str, Any], expected: object, got: object) -> None:
    asked = {"hands": [HAND, HAND], "seeds": [0, 1]} | arguments
    with refused(InputError, expected=expected, got=got):
        render_many([wild_model(1)] * 2, asked.pop("hands"), **asked)
