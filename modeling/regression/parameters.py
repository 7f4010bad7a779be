"""Regressions of every parameter of a model on speed and force (eq. 3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.regression.least_squares import (
    Regression,
    condition_predictors,
    reduced_regression,
    regress,
)

PARAMETERS = ("noise_gain", "frequency_hz", "amplitude", "bandwidth_hz")
NOISE_GAIN, FREQUENCY, AMPLITUDE, BANDWIDTH = PARAMETERS


class Observations(NamedTuple):
    """One parameter of one layer in the n conditions that determine it.

    `layer` counts from 1; 0 is the noise gain, which belongs to no layer. `inherited` is the number
    of recorded conditions left out, because the layer's frequency there was given by other
    conditions, or because its level is not identifiable. Where that leaves none, `determined` is
    false and the values are those of all recorded conditions.
    """

    parameter: str
    layer: int
    values: Floats
    speed_mm_s: Floats
    force_n: Floats
    inherited: int
    determined: bool = True

    def regressions(self, predictors: Mapping[str, ArrayLike]) -> tuple[Regression, Regression]:
        """Full and reduced; where no condition determines it, the mean (of 0 conditions)."""
        if not self.determined:
            constant = replace(regress(self.values, {}), n_conditions=0)
            return constant, constant
        return regress(self.values, predictors), reduced_regression(self.values, predictors)


def parameter_observations(model: TextureModel) -> tuple[Observations, ...]:
    """The data for the regressions of a model: n, then f, a and b of each layer.

    Interpolated conditions are left out, and of a layer those where its level is not identifiable.
    So are, for the frequency alone, those that inherited it: a copy is no observation (amplitude
    and width were fitted there and count). Amplitude is |G|.
    """
    speed, force = np.meshgrid(model.speeds_mm_s, model.forces_n, indexing="ij")
    recorded = ~model.interpolated

    def observed(parameter: str, layer: int, *, of: Floats, at: Bools) -> Observations:
        left_out, determined = int(np.count_nonzero(recorded & ~at)), bool(at.any())
        at = at if determined else recorded
        return Observations(parameter, layer, of[at], speed[at], force[at], left_out, determined)

    found = [observed(NOISE_GAIN, 0, of=model.noise_gains, at=recorded)]
    for i in range(model.n_layers):
        determined = recorded & ~model.not_identifiable[:, :, i]
        own = determined & ~model.inherited[:, :, i]
        found += [
            observed(FREQUENCY, i + 1, of=model.frequencies_hz[:, :, i], at=own),
            observed(AMPLITUDE, i + 1, of=np.abs(model.gains[:, :, i]), at=determined),
            observed(BANDWIDTH, i + 1, of=model.bandwidths_hz[:, :, i], at=determined),
        ]
    return tuple(found)


class ParameterRegression(NamedTuple):
    """Full and reduced regression of one parameter; the other fields as in `Observations`."""

    parameter: str
    layer: int
    inherited: int
    full: Regression
    reduced: Regression


def parameter_regressions(model: TextureModel) -> tuple[ParameterRegression, ...]:
    """P = β + α1·v + α2·F + α3·v·F for n and for f, a and b of each layer (eq. 3).

    Units: gains in the model's unit per unit noise, f and b in Hz, speed in mm/s, force in N.

    Raises
    ------
    InputError
        If no condition says anything about a parameter.
    """
    found = []
    for o in parameter_observations(model):
        full, reduced = o.regressions(condition_predictors(o.speed_mm_s, o.force_n))
        found.append(ParameterRegression(o.parameter, o.layer, o.inherited, full, reduced))
    return tuple(found)
