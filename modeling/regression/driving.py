"""Regressions that replace the grid of a model."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.regressed_model import RegressedModel
from tactileq.modeling.models.terms import CENTROID, DRIVING_TERMS, SPEED, DrivenBy, check_driver
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.regression.centroid import centroid_observations
from tactileq.modeling.regression.least_squares import Regression, reduced_regression
from tactileq.modeling.regression.parameters import (
    AMPLITUDE,
    BANDWIDTH,
    FREQUENCY,
    NOISE_GAIN,
    parameter_observations,
    parameter_regressions,
)


def regressed(model: TextureModel, *, by: DrivenBy = "conditions") -> RegressedModel:
    """The texture driven by reduced regressions instead of the grid.

    docs/method/regression.md#driven-models

    By the centroid, SC(v) is fitted first and every parameter then to SC(v), each reduced to what
    is significant. SC(v) being a straight line, each parameter is one in speed, too: what the
    detour buys is that one response, the centroid's, moves all layers.

    Parameters
    ----------
    by : {"conditions", "centroid"}
        What drives every parameter: speed, force and their product, by the reduced models of
        eq. 3; or the spectral centroid's response to speed alone, from which all layers are
        derived (PAPER IX-B; force then acts only below the lowest recorded one).

    Raises
    ------
    InputError
        For another word, or by="centroid" where no layer has a gain.
    """
    check_driver(by)
    centroid_hz: Floats = np.zeros(0)
    if by == CENTROID:
        centroid_hz, fits = _fits_by_centroid(model)
    else:
        fits = {(r.parameter, r.layer): r.reduced for r in parameter_regressions(model)}

    def rows(parameter: str, layers: range) -> Floats:
        chosen = [_row(fits[parameter, layer], DRIVING_TERMS[by]) for layer in layers]
        return np.array(chosen, dtype=np.float64).reshape(-1, 1 + len(DRIVING_TERMS[by])).T

    layers = range(1, model.n_layers + 1)
    return RegressedModel(
        texture=model.texture,
        rate_hz=model.rate_hz,
        driven_by=by,
        speeds_mm_s=_ends(model.speeds_mm_s),
        forces_n=_ends(model.forces_n),
        noise_gain=rows(NOISE_GAIN, range(1))[:, 0],
        frequencies_hz=rows(FREQUENCY, layers),
        bandwidths_hz=rows(BANDWIDTH, layers),
        amplitudes=rows(AMPLITUDE, layers),
        signs=np.where(model.gains[~model.interpolated].sum(axis=0) < 0, -1.0, 1.0),
        centroid_hz=centroid_hz,
        estimator=model.estimator,
        unit=model.unit,
        simulated=model.simulated,
    )


def _ends(axis: Floats) -> Floats:
    """Lowest and highest; of one value, of which nothing depends, that and twice as much."""
    return axis[[0, -1]] if axis.size > 1 else axis[0] * np.array([1.0, 2.0])


def _fits_by_centroid(model: TextureModel) -> tuple[Floats, dict[tuple[str, int], Regression]]:
    """c0 and c1 of SC(v), and every parameter's regression on SC(v)."""
    centroid, speed, _ = centroid_observations(model)
    course = _row(reduced_regression(centroid, {SPEED: speed}), (SPEED,))
    fits = {
        (o.parameter, o.layer): o.regressions({CENTROID: course[0] + course[1] * o.speed_mm_s})[1]
        for o in parameter_observations(model)
    }
    return np.array(course), fits


def _row(fit: Regression, terms: tuple[str, ...]) -> list[float]:
    """The intercept and the coefficient of each of these terms, 0 where a term was dropped."""
    return [float(fit.coefficients[0]), *(fit.coefficient(term) for term in terms)]
