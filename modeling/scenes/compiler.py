"""The least model that keeps a scene's bound (docs/method/scenes.md).

Cheapest is what takes the fewest counted operations per sample; of equals the fewest bytes; of
those the fewest stored numbers. What is searched: which of the layers that are not felt are
dropped, the interval of parameter updates, single or double precision, and what drives the
parameters: some conditions of the grid or a regression.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product
from typing import Any, TypeVar

import numpy as np

from modeling.arrays import Floats
from modeling.errors import InputError
from modeling.models.compiled_for import CompiledFor
from modeling.models.parameter_table import NEXT
from modeling.models.regressed_model import RegressedModel
from modeling.models.terms import DrivenBy
from modeling.models.texture_model import TextureModel
from modeling.perception.simplification import with_signs_chosen_again
from modeling.regression.driving import regressed
from modeling.rendering.plan import RenderPlan, plan_for
from modeling.scenes.compiled import (
    Alternative,
    CompiledScene,
    CompiledTexture,
    Measured,
    Step,
    Way,
)
from modeling.scenes.cost import scene_bytes, stored_numbers
from modeling.scenes.error_maps import ErrorMaps
from modeling.scenes.felt import at_places, kept_layers, layer_groups
from modeling.scenes.measures import Errors, Yardstick, errors_between
from modeling.scenes.places import places_of
from modeling.scenes.restricting import cut, played, thinned
from modeling.scenes.scene import Bound, Scene
from modeling.scenes.thinning import NO_LIMIT, fewest_nodes, table_numbers

# A hand that touches, turns or lifts off is noticed at most so late.
UPDATES_MS = (16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
Found = TypeVar("Found")
_WAYS: dict[DrivenBy, Way] = {"conditions": "regression", "centroid": "centroid"}
WIDEST = 64.0  # times the bound, within which the nearest one is looked for
HALVINGS = 8


def compile_scene(
    scene: Scene,
    models: Mapping[str, TextureModel],
    *,
    progress: Callable[[str], None] = lambda texture: None,
) -> CompiledScene:
    """The least model of every texture of a scene.

    Parameters
    ----------
    scene : Scene
    models : mapping of str to TextureModel
        Full models by the name of their texture, in g; those that the scene does not name are not
        used.
    progress : callable
        Told the name of each texture as it is done.

    Raises
    ------
    InputError
        For a texture without a model; for a scene beyond the recorded grid; for a bound that the
        actuator's limits or a budget do not allow, with the nearest that can be kept.
    """
    return compile_scenes([scene], models, progress=lambda scene, texture: progress(texture))[0]


def compile_scenes(
    scenes: Sequence[Scene],
    models: Mapping[str, TextureModel],
    *,
    progress: Callable[[Scene, str], None] = lambda scene, texture: None,
) -> list[CompiledScene]:
    """`compile_scene` of several scenes, which share what is known of the models' errors.

    Parameters and errors as there; `progress` is told the scene, too.
    """
    known = Known()
    return [_compiled(scene, models, known, progress=partial(progress, scene)) for scene in scenes]


def _compiled(
    scene: Scene,
    models: Mapping[str, TextureModel],
    known: Known,
    *,
    progress: Callable[[str], None],
) -> CompiledScene:
    names = scene.textures or tuple(models)
    _check_models(scene, names, models)
    searches = []
    for name in names:
        searches.append(_Search(models[name], scene, known))
        searches[-1].cheapest(scene.bound)
        progress(name)
    chosen = _within_budget(searches, scene, scene.bound)
    if chosen is None:
        raise InputError(_beyond_budget(searches, scene))
    pairs = zip(searches, chosen, strict=True)
    return CompiledScene(scene, tuple(search.compiled(candidate) for search, candidate in pairs))


def _check_models(scene: Scene, names: Sequence[str], models: Mapping[str, TextureModel]) -> None:
    missing = [name for name in names if name not in models]
    if missing or not names:
        raise InputError(
            f"expected a full model of each texture of the scene {scene.name}, got none of "
            f"{', '.join(missing) or 'any'}; model what is missing, or leave it out of the scene."
        )
    for name in names:
        if not isinstance(models[name], TextureModel):
            raise InputError(
                f"expected texture models over a grid for the scene {scene.name}, got another kind "
                f"for {name}; compile from what tactileq model made."
            )


@dataclass(frozen=True, eq=False)
class Candidate:
    """One model that keeps a bound, and what it takes of it.

    `late` and `rounding` are errors by late updates (and the actuator's limits) and by single
    precision, `at_rest` those by fewer nodes or by a regression; each at all places.
    """

    layers: tuple[int, ...]
    model: TextureModel | RegressedModel
    way: Way
    plan: RenderPlan
    late: Errors
    rounding: Errors
    at_rest: Errors

    @property
    def together(self) -> Errors:
        """All errors of the candidate."""
        return self.late + self.rounding + self.at_rest

    @cached_property
    def key(self) -> tuple[float, int, int]:
        """What it costs: operations per sample, bytes of its table and state, stored numbers."""
        cost = self.plan.cost(self.model)
        return (
            cost.operations,
            cost.table_bytes + cost.state_bytes,
            stored_numbers(self.model),
        )


def _table_numbers(model: TextureModel | RegressedModel) -> int:
    if isinstance(model, RegressedModel):
        return table_numbers(2, 2, model.n_layers)
    return table_numbers(model.speeds_mm_s.size, model.forces_n.size, model.n_layers)


class Known:
    """What is known of models whatever the scene."""

    def __init__(self) -> None:
        self._found: dict[tuple[Any, ...], Any] = {}

    def get(self, key: tuple[Any, ...], find: Callable[[], Found]) -> Found:
        """What belongs to a key: found when it is first asked for."""
        if key not in self._found:
            self._found[key] = find()
        found: Found = self._found[key]
        return found


def _holds_in_single(candidate: Candidate) -> bool:
    """Whether single precision can hold the model's numbers and tell them apart."""
    try:
        candidate.plan.texture(candidate.model)
    except InputError:
        return False
    return True


class _Search:
    """Everything that may become of one texture in a scene."""

    def __init__(self, full: TextureModel, scene: Scene, known: Known) -> None:
        self.full, self.scene, self._known = full, scene, known
        self.played = known.get(("played", full.texture), partial(played, full))
        self.places = places_of(full, scene.hand)
        self._narrowest_hz = float(full.bandwidths_hz.min(initial=full.rate_hz))
        band_hz, name = scene.actuator.band_hz, full.texture
        self.yardstick = known.get(
            ("yardstick", full.rate_hz, self._narrowest_hz, band_hz),
            partial(Yardstick, full.rate_hz, narrowest_hz=self._narrowest_hz, band_hz=band_hz),
        )
        self.rate_hz = scene.actuator.rate_hz or full.rate_hz
        groups = known.get(("groups", name), partial(layer_groups, full))
        self.kept = kept_layers(full, scene, self.places, groups=groups)
        self._counted: dict[tuple[int, int], float] = {}
        self._found: dict[tuple[Any, ...], Candidate | None] = {}
        self._lost = self._lost_to_limits()

    # --- What is known of a choice of layers

    def felt(self, layers: tuple[int, ...]) -> TextureModel:
        """The full model with these layers alone, as it is played."""
        return self.maps(layers).model

    def _played(self, layers: tuple[int, ...]) -> TextureModel:
        """The same as it is played, between the nodes of the full model's table."""
        if len(layers) == self.full.n_layers:
            return self.played
        chosen = with_signs_chosen_again(self.full, list(layers))
        fewer = self.played.with_layers(list(layers))
        signs = np.sign(chosen.gains.sum(axis=(0, 1)))
        return replace(fewer, gains=np.abs(fewer.gains) * np.where(signs < 0, -1.0, 1.0))

    def maps(self, layers: tuple[int, ...]) -> ErrorMaps:
        key = "maps", self.full.texture, layers, self.scene.actuator.band_hz
        return self._known.get(key, lambda: ErrorMaps(self._played(layers), self.yardstick))

    def _rounding(self, layers: tuple[int, ...]) -> Errors | None:
        """Of single precision, at all places; None where it cannot be rendered."""

        def find() -> Errors | None:
            try:
                return self.maps(layers).rounding(self.rate_hz)
            except InputError:  # numbers that single precision cannot hold or tell apart
                return None

        band_hz = self.scene.actuator.band_hz
        worst = self._known.get(
            ("rounding", self.full.texture, layers, band_hz, self.rate_hz), find
        )
        if worst is None:
            return None
        return Errors(*(np.full(self.places.counts.size, part[0]) for part in worst))

    def _regressed(self, layers: tuple[int, ...]) -> list[tuple[Way, RegressedModel, Errors]]:
        """The felt model driven by regressions, as far as the scene reaches, and their errors."""

        def find() -> list[tuple[Way, RegressedModel, Errors]]:
            maps = self.maps(layers)
            found: list[tuple[Way, RegressedModel, Errors]] = []
            for by in _WAYS:
                try:
                    model = regressed(maps.model, by=by)
                except InputError:  # too few conditions, or no gain that has a centroid
                    continue
                found.append((_WAYS[by], model, maps.of_model(model)))
            return found

        key = "regressed", self.full.texture, layers, self.scene.actuator.band_hz
        return [
            (way, self._ending(model), errors) for way, model, errors in self._known.get(key, find)
        ]

    def _ending(self, model: RegressedModel) -> RegressedModel:
        """Regressions from the lowest to the highest speed and force of the scene."""
        speeds, forces = (
            np.array([low, max(high, NEXT * low)])
            for low, high in (self.places.speed_range, self.places.force_range)
        )
        return replace(model, speeds_mm_s=speeds, forces_n=forces)

    # --- Candidates

    def plan(self, update_samples: int, *, single: bool) -> RenderPlan:
        return plan_for(
            self.full.rate_hz,
            rate_hz=self.rate_hz,
            update_samples=update_samples,
            limits=self.scene.actuator.limits,
            single=single,
        )

    @property
    def usual_plan(self) -> RenderPlan:
        """As models are rendered by default: an update every millisecond, double precision."""
        return plan_for(self.full.rate_hz, rate_hz=self.rate_hz, limits=self.scene.actuator.limits)

    @property
    def intervals(self) -> list[int]:
        """Update intervals in samples, longest first; the last one is every sample."""
        samples = {max(1, round(1e-3 * ms * self.rate_hz)) for ms in UPDATES_MS}
        return sorted(samples | {1}, reverse=True)

    def candidates(self, bound: Bound) -> list[Candidate]:
        """The cheapest one, and behind it those with the same layers and shorter intervals."""
        first = self.cheapest(bound)
        shorter = [u for u in self.intervals if u < first.plan.update_samples]
        others = [self._best(first.layers, samples, bound) for samples in shorter]
        return [first, *(other for other in others if other is not None)]

    def cheapest(self, bound: Bound) -> Candidate:
        """The cheapest candidate that keeps a bound: there is one, the felt model itself."""
        choices = sorted(
            (self._operations(layers, samples), layers, samples)
            for layers, samples in product(self.kept, self.intervals)
        )
        best: Candidate | None = None
        for operations, layers, samples in choices:
            if best is not None and operations > best.key[0]:
                break
            found = self._best(layers, samples, bound)
            if found is not None and (best is None or found.key < best.key):
                best = found
        assert best is not None, "with an update at every sample the felt model has no error"
        return best

    def _operations(self, layers: tuple[int, ...], samples: int) -> float:
        """Of any table with so many layers."""
        key = len(layers), samples
        if key not in self._counted:
            model = self.played.with_layers(list(layers))
            self._counted[key] = self.plan(samples, single=False).cost(model).operations
        return self._counted[key]

    def _best(self, layers: tuple[int, ...], samples: int, bound: Bound) -> Candidate | None:
        """The one with the fewest bytes; None where even the felt model breaks the bound."""
        key = layers, samples, bound
        if key not in self._found:
            self._found[key] = self._smallest(layers, samples, bound)
        return self._found[key]

    def _smallest(self, layers: tuple[int, ...], samples: int, bound: Bound) -> Candidate | None:
        late, rounding = self._late(layers, samples), self._rounding(layers)
        best = None
        if rounding is not None and self._keeps(late + rounding, bound):
            best = self._driven(layers, samples, late, rounding, bound)
        if self._keeps(late, bound):
            # Twice the bytes of a number are worth it only for less than half the numbers.
            below = NO_LIMIT if best is None else -(-_table_numbers(best.model) // 2)
            double = self._driven(layers, samples, late, None, bound, below=below)
            if double is not None and (best is None or double.key < best.key):
                best = double
        return best

    def _late(self, layers: tuple[int, ...], samples: int) -> Errors:
        """What an interval takes, with what the actuator's limits take of any model."""
        update_s = (samples - 1) / self.rate_hz  # of an update at every sample nothing is late
        return self.maps(layers).late(update_s, self.places) + self._lost

    def _keeps(self, errors: Errors, bound: Bound) -> bool:
        counts = self.places.counts.ravel()
        return bool(errors.at(counts).within(bound).all())

    def _driven(
        self,
        layers: tuple[int, ...],
        samples: int,
        late: Errors,
        rounding: Errors | None,
        bound: Bound,
        *,
        below: int = NO_LIMIT,
    ) -> Candidate | None:
        """Of one interval and precision the smallest way; None where it takes `below` numbers.

        Without errors by `rounding` it is in double precision.
        """
        maps, plan = self.maps(layers), self.plan(samples, single=rounding is not None)
        if rounding is None:
            rounding = Errors.none(late.angle.size)
        taken = late + rounding
        ways: list[tuple[Way, Any, Errors]] = [
            driven
            for driven in self._regressed(layers)
            if self._keeps(taken + driven[2], bound) and _table_numbers(driven[1]) < below
        ]
        # A grid is worth it only where it is no larger than a regression.
        below = min([below, *(_table_numbers(model) + 1 for _, model, _ in ways)])
        nodes = fewest_nodes(maps, self.places, bound=bound, taken=taken, below=below)
        if nodes is not None:
            fewer = thinned(maps.model, self.places, *nodes)
            ways.append(("grid", fewer, maps.of_nodes(*nodes)))
        note = self._note(plan)
        found = [
            Candidate(layers, replace(model, compiled_for=note), way, plan, late, rounding, at_rest)
            for way, model, at_rest in ways
        ]
        held = [each for each in found if not plan.single or _holds_in_single(each)]
        return min(held, key=lambda each: each.key, default=None)

    def _note(self, plan: RenderPlan) -> CompiledFor:
        return CompiledFor(
            scene=self.scene.name,
            scene_sha256=self.scene.sha256,
            full_sha256=self.full.sha256,
            bound=self.scene.bound.to_dict(),
            update_s=plan.update_samples / plan.rate_hz,
            single=plan.single,
        )

    # --- The result

    def compiled(self, candidate: Candidate) -> CompiledTexture:
        """A candidate with all that is told of it."""
        every = range(self.full.n_layers)
        return CompiledTexture(
            full=self.full,
            felt=self.felt(candidate.layers),
            model=candidate.model,
            dropped=tuple(layer + 1 for layer in every if layer not in candidate.layers),
            way=candidate.way,
            full_plan=self.usual_plan,
            plan=candidate.plan,
            measures=self._measures(candidate),
            steps=self._steps(candidate),
            refused=self._refused(candidate),
        )

    def share_of_bound(self, errors: Errors) -> float:
        """Of the measure and the place that take most."""
        counts = self.places.counts.ravel()
        return float(errors.at(counts).shares(self.scene.bound).max(initial=0.0))

    def _measures(self, candidate: Candidate) -> tuple[Measured, ...]:
        counts, share = self.places.counts.ravel(), self.places.share.ravel()
        weights = np.where(counts, share, 0.0) / share[counts].sum()
        at_rest, together = candidate.at_rest, candidate.together
        of_full = self._of_full(candidate)
        bound = self.scene.bound

        def measured(name: Any, kind: int) -> Measured:
            def told(error: float) -> float:
                return float(np.cos(min(error, np.pi / 2))) if name == "gfc30" else error

            place = int(np.argmax(np.where(counts, together[kind], -1.0)))
            values = np.cos(at_rest[kind]) if name == "gfc30" else at_rest[kind] ** 2
            mean = float(np.sum(weights * values))
            return Measured(
                measure=name,
                bound=float(getattr(bound, name)),
                mean=mean if name == "gfc30" else float(np.sqrt(mean)),
                worst=told(float(together[kind][place])),
                place=self.places.name(place),
                of_full=told(float(np.max(of_full[kind]))),
            )

        return tuple(measured(name, kind) for kind, name in enumerate(bound.to_dict()))

    def _of_full(self, candidate: Candidate) -> Errors:
        """Errors against the full model at the places that count, moved into the scene."""
        rows, columns = np.nonzero(self.places.counts)
        hand = (
            np.clip(self.places.speeds_mm_s[rows], *self.places.speed_range),
            np.clip(self.places.forces_n[columns], *self.places.force_range),
        )
        ours, full = (
            self.yardstick.features(model.parameters(*hand))
            for model in (candidate.model, self.full)
        )
        driven = (candidate.late + candidate.rounding).at(self.places.counts.ravel())
        return errors_between(ours, full) + driven

    def _steps(self, candidate: Candidate) -> tuple[Step, ...]:
        """What each step brings, in the order of the compiler."""
        felt = with_signs_chosen_again(self.full, list(candidate.layers))
        shorter = cut(felt, self.places)
        usual = self.usual_plan
        longer = replace(usual, update_samples=candidate.plan.update_samples)
        maps, at_rest = self.maps(candidate.layers), candidate.at_rest
        late = self._late(candidate.layers, usual.update_samples)
        stages: list[tuple[str, TextureModel | RegressedModel, RenderPlan, Errors]] = [
            ("full model", self.full, usual, late),
            ("layers not felt dropped", felt, usual, late + maps.of_model(felt)),
            ("grid cut to the scene", shorter, usual, late + self._within(maps.of_model(shorter))),
            (_DRIVEN[candidate.way], candidate.model, usual, late + at_rest),
            ("update interval", candidate.model, longer, candidate.late + at_rest),
            ("precision", candidate.model, candidate.plan, candidate.together),
        ]
        return tuple(self._step(*stage) for stage in stages)

    def _within(self, errors: Errors) -> Errors:
        """None at places that only enclose the scene, beyond which a cut model has nothing."""
        axes = (
            (self.places.speeds_mm_s, self.places.speed_range),
            (
                self.places.forces_n,
                self.places.force_range,
            ),
        )
        rows, columns = ((axis >= low) & (axis <= high) for axis, (low, high) in axes)
        inside = (rows[:, None] & columns[None, :]).ravel()
        return Errors(*(np.where(inside, part, 0.0) for part in errors))

    def _step(
        self, name: str, model: TextureModel | RegressedModel, plan: RenderPlan, errors: Errors
    ) -> Step:
        cost = plan.cost(model)
        return Step(
            step=name,
            layers=model.n_layers,
            numbers=stored_numbers(model),
            bytes=cost.table_bytes + cost.state_bytes,
            operations=cost.operations,
            share=self.share_of_bound(errors),
        )

    def _refused(self, candidate: Candidate) -> Alternative | None:
        """The next longer update interval, with which the same layers would break the bound."""
        longer = [u for u in self.intervals if u > candidate.plan.update_samples]
        if not longer:
            return None
        plan = replace(candidate.plan, update_samples=longer[-1])
        share = self.share_of_bound(self._late(candidate.layers, plan.update_samples))
        ms = 1e3 * plan.update_samples / plan.rate_hz
        return Alternative(ms, plan.cost(candidate.model).operations, share)

    # --- What the actuator does not allow

    def _lost_to_limits(self) -> Errors:
        """What the actuator's limits take of the level, whatever the model, at all places.

        Raises
        ------
        InputError
            Where it is more than the bound on the level allows.
        """
        places, loss_db = self.places, np.zeros(self.places.counts.shape)
        loss_db[places.counts] = self._loss_db()
        worst = int(np.argmax(loss_db))
        largest = float(loss_db.ravel()[worst])
        if largest > self.scene.bound.level_db:
            raise InputError(
                f"expected a level_db under [bound] that the actuator's limits leave room for, got "
                f"{self.scene.bound.level_db:g} dB, where they take {largest:.2f} dB from "
                f"{self.full.texture} at {places.name(worst)} whatever the model; the nearest is "
                f"level_db = {np.ceil(100 * largest) / 100:g}."
            )
        return Errors.none(loss_db.size)._replace(level_db=loss_db.ravel())

    def _loss_db(self) -> Floats:
        """What peak and RMS limits take from the full model's level at the places that count."""
        whole = Yardstick(self.full.rate_hz, narrowest_hz=self._narrowest_hz, band_hz=None)
        rms = np.sqrt(whole.power(at_places(self.full, self.places)))
        limits = self.scene.actuator.limits
        return np.maximum(clipped_loss_db(rms, limits.peak), _lost_db(rms, limits.rms))


_DRIVEN: dict[Way, str] = {
    "grid": "grid thinned",
    "regression": "regression on speed and force",
    "centroid": "regression on the centroid",
}


def _lost_db(rms: Floats, limit: float) -> Floats:
    if not np.isfinite(limit):
        return np.zeros_like(rms)
    lost: Floats = 20 * np.log10(np.maximum(rms / limit, 1.0))
    return lost


def clipped_loss_db(rms: Floats, peak: float) -> Floats:
    """By how much clipping at a peak lowers the level of Gaussian noise, (n,), in dB.

    With x = peak/σ the power that is left is erf(x/√2) − √(2/π)·x·exp(−x²/2) + x²·erfc(x/√2).

    Parameters
    ----------
    rms : (n,) ndarray
        σ, ≥ 0.
    peak : float
        > 0; may be infinite.
    """
    from scipy.special import erf, erfc

    if not np.isfinite(peak):
        return np.zeros_like(rms)
    x = peak / np.maximum(rms, 1e-300)
    small = np.minimum(x, 40.0)
    left = (
        erf(small / np.sqrt(2))
        - np.sqrt(2 / np.pi) * small * np.exp(-(small**2) / 2)
        + small**2 * erfc(small / np.sqrt(2))
    )
    loss: Floats = -10 * np.log10(np.minimum(left, 1.0))
    return loss


# --- Budgets


def _within_budget(
    searches: Sequence[_Search], scene: Scene, bound: Bound
) -> list[Candidate] | None:
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


def _beyond_budget(searches: Sequence[_Search], scene: Scene) -> str:
    """What a scene needs at least, and the nearest bound with which it fits."""
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
        advice = f"the nearest bound that fits is {_told(nearest)}"
    return (
        f"expected the scene {scene.name} within {' and '.join(asked)}, got one that takes "
        f"{operations:.1f} operations per sample and {_bytes(smallest)} bytes at least to keep its "
        f"bound; {advice}."
    )


def _told(bound: Bound) -> str:
    """A bound in few digits, rounded so that it asks for no more."""
    wider = {
        "gfc30": np.floor(1e4 * bound.gfc30) / 1e4,
        "bands_db": np.ceil(1e2 * bound.bands_db) / 1e2,
        "level_db": np.ceil(1e2 * bound.level_db) / 1e2,
    }
    return ", ".join(f"{name} = {value:g}" for name, value in wider.items())


def _nearest_bound(searches: Sequence[_Search], scene: Scene) -> Bound | None:
    """The least widening of the bound, to a few %, with which the budget suffices."""
    low, high = 1.0, WIDEST
    if _within_budget(searches, scene, scene.bound.widened(high)) is None:
        return None
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        fits = _within_budget(searches, scene, scene.bound.widened(middle)) is not None
        low, high = (low, middle) if fits else (middle, high)
    return scene.bound.widened(high)
