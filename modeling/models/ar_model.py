"""The rival: an autoregressive model over a grid of speeds and forces."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats, no_marks
from tactileq.modeling.checks import check_rate
from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import key
from tactileq.modeling.files.kinds import Rate, Simulated, TextureName, Unit
from tactileq.modeling.files.saved_model import SavedModel
from tactileq.modeling.models.grid import Cells, Forces, Speeds, within_grid
from tactileq.modeling.models.line_spectral import (
    check_line_spectral,
    prediction_coefficients,
    reflection_coefficients,
)
from tactileq.modeling.models.parameter_table import flushed_to_zero
from tactileq.modeling.reprs import one_line


class ARParameters(NamedTuple):
    """At n points: line spectral frequencies (n, p) in radians per sample, gain (n,)."""

    line_spectral_frequencies: Floats
    gain: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class ARFilter:
    """An all-pole filter driven by white noise w: y[n] = gain·w[n] − Σ a_k·y[n−k].

    Parameters
    ----------
    coefficients : (p,) array_like
        a₁ … a_p, p ≥ 1; the filter must be stable.
    gain : float
        Standard deviation of the innovation, ≥ 0, in g per unit noise.
    rate_hz : float
        The rate at which it runs and w has unit variance.

    Raises
    ------
    InputError
        For values that are not finite, a negative gain, or an unstable filter.
    """

    coefficients: Floats
    gain: float
    rate_hz: float

    __repr__ = one_line

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=np.float64)
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)
        if coefficients.ndim != 1 or not coefficients.size:
            raise InputError(
                "expected one row of filter coefficients, got an array of shape "
                f"{coefficients.shape}; give a₁ … a_p without the leading 1."
            )
        reflection = reflection_coefficients(coefficients)
        if not (np.abs(reflection) < 1).all():
            raise InputError(
                f"expected a stable all-pole filter, got {coefficients.tolist()}, whose poles are "
                "not all within the unit circle; fit it again."
            )
        if not (np.isfinite(self.gain) and self.gain >= 0):
            raise InputError(f"expected a gain of at least 0, got {self.gain}; fix it.")
        check_rate(self.rate_hz)

    def response(self, frequency_hz: ArrayLike) -> Floats:
        """Magnitude response gain/|A| at (n,) frequencies of 0 … rate/2, in g per unit noise.

        The one-sided power spectral density of the output is response² · 2/rate_hz (g²/Hz).
        """
        from scipy.signal import freqz

        frequency = np.asarray(frequency_hz, dtype=np.float64)
        inverse = np.concatenate([[1.0], self.coefficients])
        _, response = freqz([self.gain], inverse, worN=frequency, fs=self.rate_hz)
        return np.abs(response)


@dataclass(frozen=True, eq=False, kw_only=True)
class ARModel(SavedModel):
    """An all-pole filter of order p in each condition of a grid of S speeds × F forces."""

    FORMAT = "tactileq.ar-model"

    texture: Annotated[TextureName, key("name of the surface")]
    rate_hz: Annotated[
        Rate,
        key("at which the filters run and the driving noise has unit variance", as_given=True),
    ]
    speeds_mm_s: Speeds
    forces_n: Forces
    line_spectral_frequencies: Annotated[
        Floats,
        key(
            "rising in (0, π); p ≥ 1",
            unit="radians per sample",
            shape="speeds forces order",
            holds=lambda frequencies: frequencies.size > 0,
        ),
    ]
    gains: Annotated[
        Floats,
        key(
            "standard deviation of the innovation, in `unit` per unit noise",
            shape="speeds forces",
            ge=0,
        ),
    ]
    level_sd_db: Annotated[
        Floats,
        key(
            "standard deviation of the overall level, from the length of the records",
            unit="dB",
            shape="speeds forces",
            ge=0,
        ),
    ]
    unit: Unit = "g"
    simulated: Simulated = False
    interpolated: Annotated[
        Bools,
        key("condition without a recording, filled from its neighbours", shape="speeds forces"),
    ] = field(default_factory=no_marks)

    __repr__ = one_line

    def __post_init__(self) -> None:
        super().__post_init__()
        check_line_spectral(self.line_spectral_frequencies, f"the model of {self.texture}")

    @property
    def order(self) -> int:
        """Order of the filters, p."""
        return int(self.line_spectral_frequencies.shape[2])

    @property
    def n_parameters(self) -> int:
        """Numbers per condition: p + 1."""
        return self.order + 1

    @property
    def rendered_gains(self) -> Floats:
        """The gains (S, F), 0 where they are too small to be rendered."""
        return flushed_to_zero(self.gains)

    def parameters(self, speed_mm_s: ArrayLike, force_n: ArrayLike) -> ARParameters:
        """Bilinear interpolation over the grid; edges: docs/method/rendering.md#grid-edges.

        Line spectral frequencies are blended, not coefficients: any mean of rising frequencies
        rises, so every blend is stable. The gain is blended linearly, as a `TextureModel`'s gains
        are: it may be 0 in a condition, where a mean of logarithms would be 0 all around it.

        Parameters
        ----------
        speed_mm_s, force_n : (n,) array_like
            As in `TextureModel.parameters`.
        """
        hand, ramp = within_grid(
            self.speeds_mm_s, self.forces_n, speed_mm_s=speed_mm_s, force_n=force_n
        )
        cells = Cells(self.speeds_mm_s, self.forces_n, hand=hand)
        return ARParameters(
            cells.blend(self.line_spectral_frequencies), cells.blend(self.rendered_gains) * ramp
        )

    def filter(self, speed_mm_s: float, force_n: float) -> ARFilter:
        """The filter at one speed (mm/s) and force (N), interpolated as in `parameters`."""
        at = self.parameters(speed_mm_s, force_n)
        return ARFilter(
            coefficients=prediction_coefficients(at.line_spectral_frequencies[0]),
            gain=float(at.gain[0]),
            rate_hz=self.rate_hz,
        )
