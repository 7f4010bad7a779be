"""The parametric equalizer of one condition (docs/method/equalizer.md#response)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_rate
from tactileq.modeling.equalizer.bands import band_response, band_rms, check_bands
from tactileq.modeling.errors import InputError
from tactileq.modeling.reprs import one_line


@dataclass(frozen=True, eq=False, kw_only=True)
class PEQ:
    """A parametric equalizer: ŷ = G_w·w + Σ G_i·H_i(w) (eq. 1–2).

    Parameters
    ----------
    noise_gain : float
        G_w ≥ 0, in g per unit noise.
    frequencies_hz, bandwidths_hz, gains : (m,) array_like
        Peak frequency (1 Hz … 0.49 rate), −3 dB width (0.1 Hz … 0.45 rate) and signed peak gain
        (g per unit noise) of each layer; m ≥ 0.
    rate_hz : float
        The rate at which w has unit variance. At another rate fs the same spectrum needs w of
        variance fs/rate.

    Raises
    ------
    InputError
        For values out of range, not finite, or of different lengths.
    """

    noise_gain: float
    frequencies_hz: Floats
    bandwidths_hz: Floats
    gains: Floats
    rate_hz: float

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name in ("frequencies_hz", "bandwidths_hz", "gains"):
            value = np.array(getattr(self, name), dtype=np.float64)
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        shapes = {self.frequencies_hz.shape, self.bandwidths_hz.shape, self.gains.shape}
        if len(shapes) != 1 or self.gains.ndim != 1:
            raise InputError(
                "expected one frequency, bandwidth and gain per layer, got shapes "
                f"{sorted(shapes)}; give three arrays of one length."
            )
        check_rate(self.rate_hz)
        if not (np.isfinite(self.noise_gain) and self.noise_gain >= 0):
            raise InputError(f"expected a noise gain of at least 0, got {self.noise_gain}; fix it.")
        if not np.isfinite(self.gains).all():
            raise InputError(f"expected finite gains, got {self.gains.tolist()}; fix them.")
        check_bands(self.frequencies_hz, self.bandwidths_hz, self.rate_hz)

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Coherent magnitude response |G_w + Σ G_i H_i(f)|.

        Parameters
        ----------
        frequency_hz : (n,) array_like
            0 … rate/2.

        Returns
        -------
        (n,) ndarray
            In g per unit noise; the one-sided power spectral density of the output is
            response² · 2/rate_hz (g²/Hz).
        """
        return np.abs(self.complex_response(frequency_hz))

    def complex_response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """G_w + Σ G_i H_i(f) with its phase, (n,) complex, in g per unit noise."""
        bands = band_response(
            frequency_hz,
            centres_hz=self.frequencies_hz,
            bandwidths_hz=self.bandwidths_hz,
            rate_hz=self.rate_hz,
        )
        response: NDArray[np.complex128] = self.noise_gain + self.gains @ bands
        return response

    @property
    def band_rms(self) -> Floats:
        """RMS of each layer's output alone, (m,), in g: |G|·√(k/(1+k)), k = tan(πB/rate)."""
        return band_rms(self.gains, self.bandwidths_hz, rate_hz=self.rate_hz)
