"""All rows of one texture: every method, blending, update interval and precision."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from tactileq.analysis.textures.between import Measured
from tactileq.benches.chart.fitted import Fitted, Layered, update_samples
from tactileq.benches.chart.measures import (
    Accuracy,
    RecordYardstick,
    ReferenceMagnitude,
    frequencies_hz,
    over_conditions,
)
from tactileq.benches.chart.methods import TRUTH, Fit, Subject, fit_method
from tactileq.benches.chart.rival_fits import ByBlock, Filtered
from tactileq.benches.chart.surfaces import Material, Origin, judged_stroke, load_material
from tactileq.modeling import ARModel, InputError
from tactileq.modeling.fitting.conditions import spectra_by_condition
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.models.loading import load_model
from tactileq.modeling.recordings.spectrum import mean_spectrum
from tactileq.modeling.threads import one_linear_algebra_thread

UPDATES_MS = (1.0, 4.0, 16.0)
DOUBLE, SINGLE = "double", "single"
PRECISIONS = (DOUBLE, SINGLE)
AT, BETWEEN, STROKING = "at", "between", "stroking"
PLACES = (AT, BETWEEN, STROKING)
LOADED = "models given"


@dataclass(frozen=True)
class Judged:
    """The results for one texture.

    Parameters
    ----------
    rows : DataFrame
        One row per method, blending, update interval and precision; see `docs/chart.md`.
    fitted : dict
        By name and blending, for `timing`.
    warnings : tuple of str
        What could not be used, or fitted.
    """

    source: Origin
    rows: pd.DataFrame
    fitted: dict[tuple[str, str], Fitted]
    warnings: tuple[str, ...]


def judge(source: Origin, *, methods: Sequence[str]) -> Judged:
    """Fit every method to one texture and judge it, on one core.

    Raises
    ------
    InputError
        Where the texture cannot be loaded, or lacks a model that was given for others.
    """
    with one_linear_algebra_thread():
        material = load_material(source)
        subject = Subject(material.measured, material.truth)
        judging = _Judging(source, material)
        rows, warnings = list[dict[str, Any]](), list(material.warnings)
        fits = list[Fit]()
        for name in methods:
            if name == TRUTH and material.truth is None:
                continue
            try:
                fits.append(fit_method(name, subject))
            except InputError as error:
                warnings.append(f"no {name}: {error}")
        fits += _loaded(source)
        for fit in fits:
            rows += judging.rows(fit)
    fitted = {
        (fit.name, blending): variant
        for fit in fits
        for blending, variant in fit.variants().items()
    }
    return Judged(source, pd.DataFrame(rows), fitted, tuple(warnings))


def _loaded(source: Origin) -> list[Fit]:
    """The models that were given, with no time of fitting."""
    fits = []
    for name, path in source.models:
        model = load_model(path)
        fitted = Filtered.of(model) if isinstance(model, ARModel) else Layered(model)
        fits.append(Fit(name, LOADED, fitted, float("nan")))
    return fits


def record_yardsticks(measured: Measured) -> dict[Condition, RecordYardstick]:
    """Of every condition that was recorded and is not silent; repeats are averaged."""
    spectra = {c: mean_spectrum(found) for c, found in spectra_by_condition(measured).items()}
    return {c: RecordYardstick(found) for c, found in spectra.items() if found.magnitude.any()}


class _Judging:
    """One texture's yardsticks, computed once for all methods."""

    def __init__(self, source: Origin, material: Material) -> None:
        self._source, self._material = source, material
        self._frequency = frequencies_hz(material.rate_hz)
        self._stroke = judged_stroke(material.rate_hz)
        self._yardsticks: dict[Condition, ReferenceMagnitude] = {}
        # Often nothing is dropped, and a simplified model is the full one.
        self._known: dict[tuple[str, bool], list[dict[str, Any]]] = {}

    def rows(self, fit: Fit) -> list[dict[str, Any]]:
        """Of one method: its blendings × updates × precisions."""
        per_record_ms = 1e3 / len(self._material.measured)
        common = {
            "kind": self._source.kind,
            "surface": self._source.name,
            "simulated": self._material.simulated,
            "method": fit.name,
            "family": fit.family,
            "fit_ms": per_record_ms * (fit.seconds + self._material.prepare_s),
        }
        rows = []
        for blending, fitted in fit.variants().items():
            own = {"blending": blending, "default_blending": blending == fit.own_blending}
            found = self._found(fitted, given=fit.family == LOADED)
            rows += [common | own | row for row in found]
        return rows

    def _found(self, fitted: Fitted, *, given: bool) -> list[dict[str, Any]]:
        """What does not depend on how it was fitted; of a model that was seen, known already."""
        key = fitted.model.sha256 if isinstance(fitted, Layered) else "", given
        if key in self._known:
            return self._known[key]
        standing = self._standing(fitted, given=given)
        found = [standing | moving for moving in self._moving(fitted)]
        if isinstance(fitted, Layered):
            self._known[key] = found
        return found

    def _moving(self, fitted: Fitted) -> list[dict[str, Any]]:
        """Update intervals and precisions; blocks have an interval of their own."""
        intervals: Sequence[float] = UPDATES_MS
        if isinstance(fitted, ByBlock):
            intervals = [fitted.interval_ms]
        rows = []
        for interval_ms in intervals:
            period = update_samples(interval_ms, self._material.rate_hz)
            stroking = self._while_stroking(fitted, period)
            # In single precision the others would need another form (docs/stability.md#filters).
            for precision in PRECISIONS if isinstance(fitted, Layered) else (DOUBLE,):
                single = precision == SINGLE
                row = {"update_ms": interval_ms, "precision": precision, **stroking}
                row |= _costs(fitted, interval_ms, single=single)
                row["single_error_db"] = (
                    fitted.single_error_db(self._stroke.hand, period)
                    if single and isinstance(fitted, Layered)
                    else np.nan
                )
                rows.append(row)
        return rows

    def _standing(self, fitted: Fitted, *, given: bool) -> dict[str, float]:
        """Accuracy where the hand stays; one that was `given` may know what was held out."""
        material = self._material
        if material.truth is not None:
            found = {
                AT: self._against_truth(fitted, material.at),
                BETWEEN: self._against_truth(fitted, material.between),
            }
        else:
            found = {
                AT: self._against_records(fitted, self._recorded),
                BETWEEN: [] if given else self._against_records(fitted, self._held_out),
            }
        return {
            f"{place}_{name}": value
            for place, of_conditions in found.items()
            for name, value in over_conditions(of_conditions).items()
        }

    def _against_truth(self, fitted: Fitted, conditions: Sequence[Condition]) -> list[Accuracy]:
        return [
            self._yardstick(condition).accuracy(fitted.filter(*condition).response(self._frequency))
            for condition in conditions
        ]

    def _against_records(
        self, fitted: Fitted, yardsticks: Mapping[Condition, RecordYardstick]
    ) -> list[Accuracy]:
        return [
            yardstick.accuracy(fitted.filter(*condition))
            for condition, yardstick in yardsticks.items()
        ]

    def _while_stroking(self, fitted: Fitted, period: int) -> dict[str, float]:
        found: list[Accuracy] = []
        if self._material.truth is not None:
            filters = fitted.moving(
                self._stroke.hand,
                period,
                places=self._stroke.places,
                rate_hz=self._material.rate_hz,
            )
            found = [
                yardstick.accuracy(here.response(self._frequency))
                for here, yardstick in zip(filters, self._along_stroke, strict=True)
            ]
        return {f"{STROKING}_{name}": value for name, value in over_conditions(found).items()}

    def _yardstick(self, condition: Condition) -> ReferenceMagnitude:
        if condition not in self._yardsticks:
            truth = self._material.truth
            assert truth is not None, "asked for only where it is known"
            speed, force = condition
            true = truth.magnitude(self._frequency, speed_mm_s=speed, force_n=force)
            self._yardsticks[condition] = ReferenceMagnitude(true, self._frequency)
        return self._yardsticks[condition]

    @cached_property
    def _recorded(self) -> dict[Condition, RecordYardstick]:
        return record_yardsticks(self._material.measured)

    @cached_property
    def _held_out(self) -> dict[Condition, RecordYardstick]:
        return record_yardsticks(self._material.hidden)

    @cached_property
    def _along_stroke(self) -> list[ReferenceMagnitude]:
        speed, force = self._stroke.hand
        conditions = [(abs(float(speed[n])), float(force[n])) for n in self._stroke.places]
        return [self._yardstick(condition) for condition in conditions]


def _costs(fitted: Fitted, update_ms: float, *, single: bool) -> dict[str, Any]:
    """Counted, at 5 kHz; NaN of what cannot be rendered."""
    cost = fitted.cost(update_ms, single=single)
    known = {"layers": fitted.layers, "numbers": fitted.numbers}
    if cost is None:
        return known | dict.fromkeys(("operations", "most_operations", "bytes"), np.nan)
    return known | {
        "operations": cost.operations,
        "most_operations": cost.most_operations,
        "bytes": cost.bytes,
    }
