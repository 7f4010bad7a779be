"""Layers of one spectrum, by the name of the estimator."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.estimation.joint import fit_jointly
from tactileq.modeling.estimation.layers import Layers, check_estimator
from tactileq.modeling.estimation.paper import find_peak_frequencies, fit_layers
from tactileq.modeling.recordings.spectrum import Spectrum


def find_layers(spectrum: Spectrum, *, estimator: str = "joint") -> Layers:
    """Noise gain and layers of one spectrum alone, without a grid to track them over.

    Parameters
    ----------
    estimator : {"joint", "paper", "paper-consistent"}
    """
    if check_estimator(estimator) == "joint":
        return fit_jointly(spectrum)
    frequencies = find_peak_frequencies(spectrum)
    nothing = np.full(frequencies.shape, np.nan)
    return fit_layers(
        spectrum, frequencies, fallback_bandwidths_hz=nothing, estimator=check_estimator(estimator)
    )
