"""All that may become of one texture in a scene, the cheapest first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product
from typing import Any, TypeVar

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.modeling.models.loading import Layered
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.models.parameter_table import NEXT
from tactileq.modeling.models.regressed_model import RegressedModel
from tactileq.modeling.models.terms import DrivenBy
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.signs_of_rest import SignsOfRest
from tactileq.modeling.regression.driving import regressed
from tactileq.modeling.rendering.plan import RenderPlan, plan_for
from tactileq.modeling.scenes.compiled import Way
from tactileq.modeling.scenes.cost import stored_numbers
from tactileq.modeling.scenes.error_maps import ErrorMaps
from tactileq.modeling.scenes.felt import at_places, kept_layers
from tactileq.modeling.scenes.limit_losses import limit_loss_db
from tactileq.modeling.scenes.measures import ComparedBand, Errors
from tactileq.modeling.scenes.places import places_of
from tactileq.modeling.scenes.restricting import played, thinned
from tactileq.modeling.scenes.scene import Bound, Scene
from tactileq.modeling.scenes.thinning import NO_LIMIT, fewest_nodes, table_numbers

# A hand that touches, turns or lifts off is noticed at most so late.
UPDATES_MS = (16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
Found = TypeVar("Found")
_WAYS: dict[DrivenBy, Way] = {"conditions": "regression", "centroid": "centroid"}


@dataclass(frozen=True, eq=False)
class Candidate:
    """One model that keeps a bound, and what it takes of it.

    `late` and `rounding` are errors by late updates (and the actuator's limits) and by single
    precision, `at_rest` those by fewer nodes or by a regression; each at all places.
    """

    layers: tuple[int, ...]
    model: Layered
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
        return cost.operations, cost.bytes, stored_numbers(self.model)


def _table_numbers(model: Layered) -> int:
    if isinstance(model, RegressedModel):
        return table_numbers(2, 2, model.n_layers)
    return table_numbers(model.speeds_mm_s.size, model.forces_n.size, model.n_layers)


class ComputedModels:
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


class Search:
    """Everything that may become of one texture in a scene."""

    def __init__(self, full: TextureModel, scene: Scene, known: ComputedModels) -> None:
        self.full, self.scene, self._known = full, scene, known
        self.played = known.get(("played", full.texture), partial(played, full))
        self.places = places_of(full, scene.hand)
        band_hz, name = scene.actuator.band_hz, full.texture
        self.yardstick = known.get(
            ("yardstick", name, band_hz), partial(ComparedBand.of, full, band_hz=band_hz)
        )
        self.rate_hz = scene.actuator.rate_hz or full.rate_hz
        groups = known.get(("groups", name), lambda: own_peaks(full).groups)
        self._signs = known.get(("signs", name), partial(SignsOfRest.of_model, full))
        self.kept = kept_layers(full, scene, self.places, groups=groups, signs=self._signs)
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
        fewer = self.played.with_layers(list(layers))
        return replace(fewer, gains=self._signs.gains(self.played.gains, layers))

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
        late, rounding = self.late(layers, samples), self._rounding(layers)
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

    def late(self, layers: tuple[int, ...], samples: int) -> Errors:
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
        key = "nodes", self.full.texture, layers, self.scene.actuator.band_hz
        nodes = self._known.get(
            (*key, repr(self.scene.hand.to_dict()), bound, taken.key, below),
            partial(fewest_nodes, maps, self.places, bound=bound, taken=taken, below=below),
        )
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

    # --- What the actuator does not allow

    def _lost_to_limits(self) -> Errors:
        """What the actuator's limits take of the level, whatever the model, at all places.

        Raises
        ------
        InputError
            If it is more than the bound on the level allows.
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
        whole = ComparedBand.of(self.full, band_hz=None)
        rms = np.sqrt(whole.power(at_places(self.full, self.places)))
        return limit_loss_db(rms, self.scene.actuator.limits)
