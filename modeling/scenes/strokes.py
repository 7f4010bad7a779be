"""Whether a compiled model keeps its bound as it is rendered: random strokes, second by second.

docs/method/scenes.md#strokes
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.rendering.renderer import Renderer
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.hands import STROKE_HZ, HandRange, HandUse
from tactileq.modeling.scenes.measures import ComparedBand, Features, errors_between
from tactileq.modeling.scenes.places import ranges_of
from tactileq.modeling.scenes.scene import Scene
from tactileq.modeling.seeds import generator

WINDOW_S = 1.0
SETTLING_S = 0.5


class Windows(NamedTuple):
    """How many windows of 1 s kept the bound, of how many, and what the worst took of it."""

    kept: int
    of: int
    worst_share: float


def windows_kept(
    compiled: CompiledTexture, scene: Scene, *, count: int = 20, seed: int = 0
) -> Windows:
    """Render the compiled model and what is felt of the full one along a random stroke; compare.

    Both get the same noise, so that what differs are the models. What is felt of the full one is
    updated at every sample in double precision. Neither has the actuator's limits, which would
    touch both alike.

    Parameters
    ----------
    scene : Scene
        The one that it was compiled for.
    count : int
        Windows, ≥ 1; each continues where the last one ended.
    seed : int
        Of the stroke and the noise.
    """
    plan = compiled.plan
    yardstick = ComparedBand.of(compiled.full, band_hz=scene.actuator.band_hz)
    settling, window = (round(s * plan.rate_hz) for s in (SETTLING_S, WINDOW_S))
    samples = settling + count * window
    hand = random_stroke(compiled.full, scene.hand, samples, rate_hz=plan.rate_hz, seed=seed)
    truth = Renderer(compiled.felt, rate_hz=plan.rate_hz, seed=seed, update_samples=1)
    ours = Renderer(
        compiled.model,
        rate_hz=plan.rate_hz,
        seed=seed,
        update_samples=plan.update_samples,
        single=plan.single,
    )
    features = [
        _windows(renderer.render(*hand)[settling:].reshape(count, window), yardstick, plan.rate_hz)
        for renderer in (ours, truth)
    ]
    errors = errors_between(*features)
    kept = errors.within(scene.bound)
    return Windows(int(kept.sum()), count, float(errors.shares(scene.bound).max()))


def random_stroke(
    model: TextureModel, hand: HandUse, samples: int, *, rate_hz: float, seed: int = 0
) -> Hand:
    """A hand within a scene: from one random place of it to the next, as fast as it strokes.

    Of a range all places are alike; else they come by their share of the time.
    """
    stroke_hz = hand.stroke_hz if isinstance(hand, HandRange) else STROKE_HZ
    turn = max(1, round(rate_hz / (2 * max(stroke_hz, 1e-3))))
    count = samples // turn + 2
    rng = generator(seed, 14)
    if isinstance(hand, HandRange):
        speeds, forces = (rng.uniform(*ends, count) for ends in ranges_of(model, hand))
    else:
        chosen = rng.choice(hand.share.size, count, p=hand.share)
        speeds, forces = hand.speed_mm_s[chosen], hand.force_n[chosen]
    at = np.arange(samples)
    leg, passed = at // turn, (1 - np.cos(np.pi * (at % turn) / turn)) / 2
    return Hand(*(x[leg] + (x[leg + 1] - x[leg]) * passed for x in (speeds, forces)))


def _windows(samples: Floats, yardstick: ComparedBand, rate_hz: float) -> Features:
    """Of windows (k, n): the mean power around each frequency of the yardstick."""
    power = np.abs(np.fft.rfft(samples * np.hanning(samples.shape[1]))) ** 2
    frequency = np.fft.rfftfreq(samples.shape[1], 1 / rate_hz)
    step_hz = yardstick.frequency_hz[1]
    group = np.rint(frequency / step_hz).astype(int)
    within = group < yardstick.frequency_hz.size
    sizes = np.bincount(group[within])
    means = [np.bincount(group[within], weights=row) / sizes for row in power[:, within]]
    return yardstick.features_of(np.sqrt(means))
