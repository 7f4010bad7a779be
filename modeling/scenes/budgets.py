"""Models of several textures within one budget (docs/method/scenes.md#sharing-and-budgets)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactileq.modeling.scenes.cost import scene_bytes
from tactileq.modeling.scenes.scene import Bound, Scene
from tactileq.modeling.scenes.search import Candidate, Search

WIDEST = 64.0  # times the bound, within which the nearest one is looked for
HALVINGS = 8


def within_budget(searches: Sequence[Search], scene: Scene, bound: Bound) -> list[Candidate] | None:
    """One candidate of each texture, with the fewest operations in sum that a budget allows."""
    most = [scene.budget.most_operations(search.rate_hz) for search in searches]
    cheapest = [search.cheapest(bound) for search in searches]
    if any(each.key[0] > limit for each, limit in zip(cheapest, most, strict=True)):
        return None
    if _bytes(cheapest) <= scene.budget.most_bytes:
        return cheapest
    allowed = [
        [each for each in search.candidates(bound) if each.key[0] <= limit]
        for search, limit in zip(searches, most, strict=True)
    ]
    return _fewest_operations(allowed, scene.budget.most_bytes)


def _bytes(chosen: Sequence[Candidate]) -> int:
    return scene_bytes((each.model, each.plan) for each in chosen)


def _fewest_operations(
    allowed: Sequence[Sequence[Candidate]], most_bytes: float
) -> list[Candidate] | None:
    """Of all combinations that take few enough bytes the one with the fewest operations in sum.

    Combinations that are beaten in both by another of the same textures cannot become the best one
    and are left out.
    """
    partial: list[tuple[float, int, list[Candidate]]] = [(0.0, 0, [])]
    for candidates in allowed:
        longer = [
            (operations + each.key[0], size + each.key[1], [*chosen, each])
            for operations, size, chosen in partial
            for each in candidates
        ]
        longer.sort(key=lambda combination: combination[:2])
        partial, least = [], np.inf
        for combination in longer:
            if combination[1] < least:
                partial.append(combination)
                least = combination[1]
    fitting = [chosen for _, _, chosen in partial if _bytes(chosen) <= most_bytes]
    return fitting[0] if fitting else None


def beyond_budget(searches: Sequence[Search], scene: Scene) -> str:
    """The minimum that a scene needs, and the closest bound with which it fits."""
    cheapest = [search.candidates(scene.bound) for search in searches]
    operations = max(each[0].key[0] for each in cheapest)
    smallest = [min(each, key=lambda candidate: candidate.key[1]) for each in cheapest]
    allowed = min(scene.budget.most_operations(search.rate_hz) for search in searches)
    asked = []
    if np.isfinite(allowed):
        asked.append(f"{allowed:g} operations per sample")
    if np.isfinite(scene.budget.most_bytes):
        asked.append(f"{scene.budget.most_bytes:.0f} bytes")
    nearest = _nearest_bound(searches, scene)
    advice = "raise the budget, or take fewer textures"
    if nearest is not None:
        advice = f"the closest bound that fits is {_bound_in_words(nearest)}"
    return (
        f"expected the scene {scene.name} within {' and '.join(asked)}, got one that takes "
        f"{operations:.1f} operations per sample and {_bytes(smallest)} bytes at least to keep its "
        f"bound; {advice}."
    )


def _bound_in_words(bound: Bound) -> str:
    """A bound in few digits, rounded so that it is not stricter."""
    wider = {
        "gfc30": np.floor(1e4 * bound.gfc30) / 1e4,
        "bands_db": np.ceil(1e2 * bound.bands_db) / 1e2,
        "level_db": np.ceil(1e2 * bound.level_db) / 1e2,
    }
    return ", ".join(f"{name} = {value:g}" for name, value in wider.items())


def _nearest_bound(searches: Sequence[Search], scene: Scene) -> Bound | None:
    """The smallest relaxation of the bound, to a few %, with which the budget suffices."""
    low, high = 1.0, WIDEST
    if within_budget(searches, scene, scene.bound.widened(high)) is None:
        return None
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        fits = within_budget(searches, scene, scene.bound.widened(middle)) is not None
        low, high = (low, middle) if fits else (middle, high)
    return scene.bound.widened(high)
