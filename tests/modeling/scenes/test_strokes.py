"""Compiled models as they are rendered: random strokes inside the scene, and hands beyond it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import InputError, Renderer, TextureModel, fit_texture
from tactileq.modeling.recordings.trajectory import Trajectory
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.hands import HandRange, HandUse, distributed_hand
from tactileq.modeling.scenes.hands import recorded_hand as recorded
from tactileq.modeling.scenes.measures import ComparedBand, errors_between
from tactileq.modeling.scenes.places import ranges_of
from tactileq.modeling.scenes.scene import Actuator, Scene
from tactileq.modeling.scenes.strokes import Windows, random_stroke, windows_kept
from tactileq.stimuli.planted.drawn import draw_surface
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

Compile = Callable[[TextureModel, Scene], CompiledTexture]
TIME_S = np.linspace(0, 10, 2001)
SINE = Trajectory("sine", TIME_S, 250 * np.sin(2 * np.pi * TIME_S), 1.5 + np.sin(3 * TIME_S))
MODEL = planted_texture("canvas")
FULL = HandRange(speed_mm_s=(50.0, 350.0), force_n=(0.5, 3.5))
SLOW = HandRange(speed_mm_s=(50.0, 150.0), force_n=(0.5, 1.0))
HANDS: dict[str, HandUse] = {
    "full": FULL,
    "slow": SLOW,
    "all that was recorded": HandRange(speed_mm_s="recorded", force_n="recorded"),
    "fast strokes": HandRange(speed_mm_s=(50.0, 350.0), force_n=(0.5, 3.5), stroke_hz=6.0),
    "recorded": recorded(SINE),
    "distribution": distributed_hand([80, 200, 330], [1, 2, 1], [0.7, 0.2, 0.1]),
}
ACTUATORS = {
    "any": Actuator(),
    "40–400 Hz": Actuator(band_hz=(40.0, 400.0)),
    "48 kHz": Actuator(rate_hz=48000.0),
}


@pytest.fixture(scope="module")
def compiled_for(compile_one: Compile) -> Callable[..., tuple[CompiledTexture, Scene]]:
    """A planted texture compiled for a hand and an actuator of these names, once."""

    @cache
    def compiled(texture: str, hand: str, actuator: str = "any") -> tuple[CompiledTexture, Scene]:
        scene = Scene(name=hand, hand=HANDS[hand], actuator=ACTUATORS[actuator])
        return compile_one(planted_texture(texture), scene), scene

    return compiled


@pytest.mark.parametrize(
    ("texture", "hand", "actuator"),
    [
        ("PVC", "full", "any"),
        ("wall paper", "full", "40–400 Hz"),
        ("canvas", "slow", "any"),
        ("PVC", "slow", "40–400 Hz"),
        ("leather", "fast strokes", "any"),
        ("aluminum", "recorded", "any"),
        ("MDF", "distribution", "any"),
        ("polyester", "full", "48 kHz"),
    ],
)
def test_the_bound_is_kept_along_random_strokes(
    texture: str, hand: str, actuator: str, compiled_for: Any
) -> None:
    compiled, scene = compiled_for(texture, hand, actuator)
    count = 20 if actuator == "48 kHz" else 100
    windows = windows_kept(compiled, scene, count=count, seed=1)
    assert windows.of == count
    assert windows.kept >= 0.99 * count


@pytest.fixture(scope="module", params=[0, 1])
def drawn(request: pytest.FixtureRequest) -> TextureModel:
    """A random surface, recorded for a short time in few conditions, as a model of today's fit."""
    surface = draw_surface(request.param)
    return fit_texture(surface.record((50.0, 150.0, 350.0), (0.5, 3.5), seed=request.param))


def test_the_bound_is_kept_on_drawn_surfaces(drawn: TextureModel, compile_one: Compile) -> None:
    scene = Scene(name="drawn", hand=FULL)
    compiled = compile_one(drawn, scene)
    windows = windows_kept(compiled, scene, count=100)
    assert windows.kept >= 99


def test_another_textures_model_breaks_the_bound(compiled_for: Any) -> None:
    compiled, scene = compiled_for("PVC", "full")
    other, _ = compiled_for("canvas", "slow")
    windows = windows_kept(replace(compiled, model=other.model), scene, count=10)
    assert windows.kept == 0
    assert windows.worst_share > 3


@pytest.mark.parametrize(("texture", "hand"), [("PVC", "full"), ("leather", "fast strokes")])
def test_updates_that_come_far_too_late_break_the_bound(
    texture: str, hand: str, compiled_for: Any
) -> None:
    compiled, scene = compiled_for(texture, hand)
    plan = replace(compiled.plan, update_samples=25 * compiled.plan.update_samples)
    late = windows_kept(replace(compiled, plan=plan), scene, count=20)
    assert late.worst_share > 1
    assert late.kept < 20


def test_a_model_is_no_different_from_itself(compiled_for: Any) -> None:
    compiled, scene = compiled_for("PVC", "full")
    plan = replace(compiled.plan, update_samples=1, single=False)
    same = replace(compiled, model=compiled.felt, plan=plan)
    assert windows_kept(same, scene, count=3) == Windows(3, 3, 0.0)


def test_the_worst_error_is_the_one_that_is_rendered(compiled_for: Any) -> None:
    """The hand at rest at the worst place: two records with the same noise tell the same."""
    compiled, _ = compiled_for("PVC", "full")
    worst = max(compiled.measures, key=lambda m: m.measure == "bands_db")
    speed, force = (float(part.split()[0]) for part in worst.place.split(", "))
    records = []
    for model in (compiled.model, compiled.felt):
        samples = Renderer(model, update_samples=1).render(speed, force, samples=100_000)
        power = np.abs(np.fft.rfft(samples * np.hanning(samples.size))) ** 2
        records.append(power)
    yardstick = ComparedBand(5000.0, narrowest_hz=18.0, band_hz=None)
    step = round(100_000 / 5000 * yardstick.frequency_hz[1])
    means = [np.sqrt(np.convolve(power, np.ones(step) / step, "same")[::step]) for power in records]
    ours, felt = (yardstick.features_of(m[None, : yardstick.frequency_hz.size]) for m in means)
    told = yardstick.features(compiled.model.parameters([speed], [force]))
    truth = yardstick.features(compiled.felt.parameters([speed], [force]))
    for found, expected in zip(
        errors_between(ours, felt), errors_between(told, truth), strict=True
    ):
        assert found[0] == pytest.approx(expected[0], rel=0.05, abs=0.01)


# --- Hands


@pytest.mark.parametrize("hand", HANDS)
def test_a_random_stroke_stays_inside_the_scene(hand: str) -> None:
    use = HANDS[hand]
    stroke = random_stroke(MODEL, use, 20_000, rate_hz=5000.0, seed=3)
    ends = ranges_of(MODEL, use) if isinstance(use, HandRange) else use.ranges
    for values, (low, high) in zip(stroke, ends, strict=True):
        assert low <= values.min() < low + 0.4 * (high - low)
        assert high - 0.4 * (high - low) < values.max() <= high
        assert values.size == 20_000


def test_a_random_stroke_follows_its_seed_alone() -> None:
    one, same, other = (random_stroke(MODEL, FULL, 500, rate_hz=1000.0, seed=n) for n in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_a_hand_that_does_not_stroke_stays_where_it_is() -> None:
    still = HandRange(speed_mm_s=(50.0, 350.0), force_n=(0.5, 3.5), stroke_hz=0.0)
    stroke = random_stroke(MODEL, still, 500, rate_hz=1000.0)
    assert np.ptp(stroke.speed_mm_s) < 1e-3


# --- Outside the scene


@pytest.mark.parametrize("way", ["thinned", "regressed", "one place"])
def test_outside_its_scene_a_model_counts_and_stays_safe(way: str, compile_one: Compile) -> None:
    full = planted_texture("wall paper")
    ends = {"thinned": ((100.0, 300.0), (1.0, 2.0)), "one place": ((200.0, 200.0), (1.0, 1.0))}
    speeds, forces = ends.get(way, ((100.0, 150.0), (1.0, 1.3)))
    hand = HandRange(speed_mm_s=speeds, force_n=forces, stroke_hz=0.0)
    compiled = compile_one(full, Scene(name=way, hand=hand))

    def level(speed: float, force: float) -> tuple[float, Any]:
        renderer = compiled.renderer()
        samples = renderer.render(speed, force, samples=10_000)
        assert np.isfinite(samples).all()
        return float(np.sqrt(np.mean(samples**2))), renderer.counters

    (low, high), (light, hard) = speeds, forces
    at_top, inside = level(high, hard)
    assert (inside.above_grid, inside.below_grid) == (0, 0)
    for speed, force in ((1.01 * high, hard), (3 * high, hard), (high, 5 * hard), (1e5, 1e4)):
        beyond, counters = level(speed, force)
        assert beyond == pytest.approx(at_top, rel=1e-6)
        assert (counters.above_grid, counters.below_grid) == (10_000, 0)
    at_bottom, inside = level(low, light)
    assert (inside.above_grid, inside.below_grid) == (0, 0)
    for speed, force in ((low / 2, light), (low, 0.1 * light), (low / 2, light / 2)):
        below, counters = level(speed, force)
        expected = at_bottom * (speed / low) * (force / light)
        assert below == pytest.approx(expected, rel=1e-3)
        assert (counters.above_grid, counters.below_grid) == (0, 10_000)


def test_only_samples_outside_the_scene_are_counted(compiled_for: Any) -> None:
    compiled, _ = compiled_for("canvas", "slow")
    interval = compiled.plan.update_samples
    renderer = compiled.renderer()
    speed = np.repeat([100.0, 200.0, 100.0, 40.0, 0.0, np.nan], 5 * interval)
    renderer.render(speed, np.full(speed.size, 0.75))
    assert renderer.counters.above_grid == 5 * interval
    assert renderer.counters.below_grid == 5 * interval
    assert renderer.counters.lift_offs == 5 * interval


def test_a_scene_beyond_the_planted_grid_is_refused(compile_one: Compile) -> None:
    hand = HandRange(speed_mm_s=(20.0, 100.0), force_n=(0.5, 1.0))
    with refused(InputError, expected=["50…350 mm/s", "PVC"], got="20…100 mm/s"):
        compile_one(planted_texture("PVC"), Scene(name="too slow", hand=hand))
