"""What is reported of a compiled texture: measures, steps, and what was refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tactileq.modeling.models.loading import Layered
from tactileq.modeling.perception.signs_of_rest import with_signs_chosen_again
from tactileq.modeling.rendering.plan import RenderPlan
from tactileq.modeling.scenes.compiled import Alternative, CompiledTexture, Measured, Step, Way
from tactileq.modeling.scenes.cost import stored_numbers
from tactileq.modeling.scenes.measures import Errors, errors_between
from tactileq.modeling.scenes.restricting import cut
from tactileq.modeling.scenes.search import Candidate, Search

_DRIVEN: dict[Way, str] = {
    "grid": "grid thinned",
    "regression": "regression on speed and force",
    "centroid": "regression on the centroid",
}


def compiled_texture(search: Search, candidate: Candidate) -> CompiledTexture:
    """A candidate with all that is reported of it."""
    every = range(search.full.n_layers)
    return CompiledTexture(
        full=search.full,
        felt=search.felt(candidate.layers),
        model=candidate.model,
        dropped=tuple(layer + 1 for layer in every if layer not in candidate.layers),
        way=candidate.way,
        full_plan=search.usual_plan,
        plan=candidate.plan,
        measures=_measures(search, candidate),
        steps=_steps(search, candidate),
        refused=_refused(search, candidate),
    )


def share_of_bound(search: Search, errors: Errors) -> float:
    """Of the measure and the place that take most."""
    counts = search.places.counts.ravel()
    return float(errors.at(counts).shares(search.scene.bound).max(initial=0.0))


def _measures(search: Search, candidate: Candidate) -> tuple[Measured, ...]:
    counts, share = search.places.counts.ravel(), search.places.share.ravel()
    weights = np.where(counts, share, 0.0) / share[counts].sum()
    at_rest, together = candidate.at_rest, candidate.together
    of_full = _errors_of_full_model(search, candidate)
    bound = search.scene.bound

    def measured(name: Any, kind: int) -> Measured:
        def reported(error: float) -> float:
            return float(np.cos(min(error, np.pi / 2))) if name == "gfc30" else error

        place = int(np.argmax(np.where(counts, together[kind], -1.0)))
        values = np.cos(at_rest[kind]) if name == "gfc30" else at_rest[kind] ** 2
        mean = float(np.sum(weights * values))
        return Measured(
            measure=name,
            bound=float(getattr(bound, name)),
            mean=mean if name == "gfc30" else float(np.sqrt(mean)),
            worst=reported(float(together[kind][place])),
            place=search.places.name(place),
            of_full=reported(float(np.max(of_full[kind]))),
        )

    return tuple(measured(name, kind) for kind, name in enumerate(bound.to_dict()))


def _errors_of_full_model(search: Search, candidate: Candidate) -> Errors:
    """Errors against the full model at the places that count, moved into the scene."""
    ours, full = (
        search.yardstick.features(model.parameters(*search.places.visited))
        for model in (candidate.model, search.full)
    )
    driven = (candidate.late + candidate.rounding).at(search.places.counts.ravel())
    return errors_between(ours, full) + driven


def _steps(search: Search, candidate: Candidate) -> tuple[Step, ...]:
    """The effect of each step, in the order of the compiler."""
    felt = with_signs_chosen_again(search.full, list(candidate.layers))
    shorter = cut(felt, search.places)
    usual = search.usual_plan
    longer = replace(usual, update_samples=candidate.plan.update_samples)
    maps, at_rest = search.maps(candidate.layers), candidate.at_rest
    late = search.late(candidate.layers, usual.update_samples)
    stages: list[tuple[str, Layered, RenderPlan, Errors]] = [
        ("full model", search.full, usual, late),
        ("layers not felt dropped", felt, usual, late + maps.of_model(felt)),
        ("grid cut to the scene", shorter, usual, late + _within(search, maps.of_model(shorter))),
        (_DRIVEN[candidate.way], candidate.model, usual, late + at_rest),
        ("update interval", candidate.model, longer, candidate.late + at_rest),
        ("precision", candidate.model, candidate.plan, candidate.together),
    ]
    return tuple(_step(search, *stage) for stage in stages)


def _within(search: Search, errors: Errors) -> Errors:
    """None at places that only enclose the scene, beyond which a cut model has nothing."""
    places = search.places
    rows, columns = (
        (axis >= low) & (axis <= high)
        for axis, (low, high) in (
            (places.speeds_mm_s, places.speed_range),
            (places.forces_n, places.force_range),
        )
    )
    inside = (rows[:, None] & columns[None, :]).ravel()
    return Errors(*(np.where(inside, part, 0.0) for part in errors))


def _step(
    search: Search,
    name: str,
    model: Layered,
    plan: RenderPlan,
    errors: Errors,
) -> Step:
    cost = plan.cost(model)
    return Step(
        step=name,
        layers=model.n_layers,
        numbers=stored_numbers(model),
        bytes=cost.bytes,
        operations=cost.operations,
        share=share_of_bound(search, errors),
    )


def _refused(search: Search, candidate: Candidate) -> Alternative | None:
    """The next longer update interval, with which the same layers would break the bound."""
    longer = [u for u in search.intervals if u > candidate.plan.update_samples]
    if not longer:
        return None
    plan = replace(candidate.plan, update_samples=longer[-1])
    share = share_of_bound(search, search.late(candidate.layers, plan.update_samples))
    ms = 1e3 * plan.update_samples / plan.rate_hz
    return Alternative(ms, plan.cost(candidate.model).operations, share)
