"""The amplitude of a layer, as it is compared with a threshold.

docs/method/perception.md#criteria
"""

from __future__ import annotations

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_rms
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.verdicts import CriterionName

PAPER_RECORD_S = 1.0


def layer_amplitudes_g(model: TextureModel | PEQ, *, criterion: CriterionName) -> Floats:
    """The amplitude of each layer, were it alone, in g peak.

    (S, F, m) for a model, (m,) for the PEQ of one condition.

    `energy`: the sinusoid of equal power, √2·G·√(k/(1+k)). `paper-fft`: the single-sided FFT
    amplitude of the peak in a record of 1 s, G·√(π/N). `paper-gain`: G itself
    (docs/method/perception.md#criteria). By the paper's two it is what decides; by `energy` it is
    so only of a layer without others and without noise
    (`tactileq.modeling.perception.power_changes`).
    """
    gains = np.abs(model.gains)
    if criterion == "paper-gain":
        return gains
    if criterion == "paper-fft":
        return gains * float(np.sqrt(np.pi / (PAPER_RECORD_S * model.rate_hz)))
    rms = band_rms(gains, model.bandwidths_hz, rate_hz=model.rate_hz)
    return rms * float(np.sqrt(2))
