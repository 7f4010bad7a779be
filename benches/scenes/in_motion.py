"""A compiled texture along random strokes: its time per sample, and how often the bound is kept."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from tactileq.modeling import Renderer, Scene
from tactileq.modeling.hand import Hand
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.strokes import Windows, random_stroke, windows_kept

WINDOWS = 60
TURNS = 5


@dataclass(frozen=True)
class InMotion:
    """What random strokes show.

    Parameters
    ----------
    full_ns, least_ns : float
        Per sample on this machine, of the full and of the least model.
    windows : Windows
        Windows of 1 s, and in how many of them the bound is kept.
    """

    full_ns: float
    least_ns: float
    windows: Windows


def in_motion(texture: CompiledTexture, scene: Scene, *, seed: int) -> InMotion:
    """Render random strokes with the full and the least model; needs the compiled kernel."""
    plan = texture.full_plan
    full = Renderer(texture.full, rate_hz=plan.rate_hz, update_samples=plan.update_samples)
    hand = random_stroke(
        texture.full, scene.hand, round(plan.rate_hz), rate_hz=plan.rate_hz, seed=seed
    )
    return InMotion(
        _ns_per_sample(full, hand),
        _ns_per_sample(texture.renderer(), hand),
        windows_kept(texture, scene, count=WINDOWS, seed=seed),
    )


def _ns_per_sample(renderer: Renderer, hand: Hand) -> float:
    """How long this machine takes to render a sample of a stroke, the fastest of several runs."""
    vibration = np.empty(hand.speed_mm_s.size, dtype=renderer.plan.precision)
    taken = []
    for _ in range(TURNS):
        began = perf_counter()
        renderer.render(*hand, out=vibration)
        taken.append(perf_counter() - began)
    return 1e9 * min(taken) / vibration.size
