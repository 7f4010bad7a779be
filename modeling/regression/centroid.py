"""The spectral centroid's response to speed and force (eq. 4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.terms import SPEED
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.regression.least_squares import (
    ROUNDING,
    Regression,
    condition_predictors,
    regress,
)


def spectral_centroid_hz(model: TextureModel) -> Floats:
    """Spectral centroid Σ G²f / Σ G² of each condition, (S, F), in Hz (eq. 4).

    NaN where no layer has a gain.
    """
    power = model.gains**2
    with np.errstate(invalid="ignore"):
        centroid: Floats = (power * model.frequencies_hz).sum(axis=2) / power.sum(axis=2)
    return centroid


def with_centroid(model: TextureModel) -> Bools:
    """The recorded conditions that have a centroid, (S, F)."""
    chosen: Bools = ~model.interpolated & np.isfinite(spectral_centroid_hz(model))
    return chosen


def centroid_observations(model: TextureModel) -> tuple[Floats, Floats, Floats]:
    """Centroid (Hz), speed (mm/s) and force (N) of the n recorded conditions that have one.

    Raises
    ------
    InputError
        If none has.
    """
    centroid = spectral_centroid_hz(model)
    chosen = with_centroid(model)
    if not chosen.any():
        raise InputError(
            f"{model.texture}: expected a layer with a gain for a spectral centroid, got none; "
            "use what needs no layers."
        )
    speed, force = np.meshgrid(model.speeds_mm_s, model.forces_n, indexing="ij")
    return centroid[chosen], speed[chosen], force[chosen]


class CentroidRegression(NamedTuple):
    """The centroid over speed, force and their product, and over speed alone."""

    full: Regression
    speed_only: Regression


def centroid_regression(model: TextureModel) -> CentroidRegression:
    """Regressions of the spectral centroid in Hz (eq. 3–4); errors as `centroid_observations`."""
    centroid, speed, force = centroid_observations(model)
    return CentroidRegression(
        regress(centroid, condition_predictors(speed, force)), regress(centroid, {SPEED: speed})
    )


class Correlation(NamedTuple):
    """Pearson's r over n conditions and its two-sided p; NaN where one of the two is constant."""

    r: float
    p: float
    n_conditions: int


def centroid_correlations(model: TextureModel) -> tuple[Correlation, ...]:
    """Correlation of the centroid with amplitude over the recorded conditions (PAPER IV-C).

    Returns
    -------
    tuple of Correlation
        With the total amplitude √ΣG² first, then with |G| of each layer.

    Raises
    ------
    InputError
        If no layer has a gain.
    """
    centroid, _, _ = centroid_observations(model)
    gains = model.gains[with_centroid(model)]
    amplitudes = [np.sqrt((gains**2).sum(axis=1)), *np.abs(gains).T]
    return tuple(_pearson(centroid, amplitude) for amplitude in amplitudes)


def _pearson(a: Floats, b: Floats) -> Correlation:
    from scipy.stats import pearsonr

    constant = any(np.ptp(x) <= ROUNDING * np.abs(x).max() for x in (a, b))
    if constant or a.size < 3:
        return Correlation(np.nan, np.nan, a.size)
    found = pearsonr(a, b)
    return Correlation(float(found.statistic), float(found.pvalue), a.size)
