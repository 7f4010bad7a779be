"""Rendering a texture model as a stroke goes on: the reference, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from modeling.autoregressive import ARModel
from modeling.errors import InputError
from modeling.filters import BandFilter, LatticeFilter, LayeredModel, StreamFilter
from modeling.noise import stream_key
from modeling.peq import Floats

UPDATE_S = 1e-3


@dataclass
class RenderCounters:
    """What the renderer had to correct so far."""

    lift_offs: int = 0
    clamped: int = 0


class Renderer:
    """Vibration of a texture model under a moving hand (eq. 1–2, METHOD 3, 4 and 9).

    The state carries on from call to call: rendering in blocks of any size gives the same bits.

    Parameters
    ----------
    model : TextureModel, RegressedModel or ARModel
        What to render.
    rate_hz : float, optional
        Output rate, at least the model's (the default). Level and spectrum stay the same: w
        gets the variance rate/model rate and the noise branch ends at the model's Nyquist
        frequency (only a band's far skirts rise, by up to 1 dB, as the filter warps less). An
        ARModel is rendered at its own rate only.
    seed, stream : int
        Which noise; two renderers with the same pair give the same signal.

    Raises
    ------
    InputError
        For a rate below the model's, or another one than an ARModel's.
    """

    def __init__(
        self,
        model: LayeredModel | ARModel,
        *,
        rate_hz: float | None = None,
        seed: int = 0,
        stream: int = 0,
    ) -> None:
        self.model = model
        self.rate_hz = model.rate_hz if rate_hz is None else float(rate_hz)
        self._filter: StreamFilter = (
            LatticeFilter(model, self.rate_hz)
            if isinstance(model, ARModel)
            else BandFilter(model, self.rate_hz)
        )
        # One parameter update per millisecond: 5 samples at 5 kHz (METHOD 9).
        self.update_samples = max(1, round(UPDATE_S * self.rate_hz))
        self.counters = RenderCounters()
        self._key = stream_key(seed, stream)
        self._position = 0
        self._setting = self._filter.silence()

    def render(
        self, speed_mm_s: ArrayLike, force_n: ArrayLike, *, samples: int | None = None
    ) -> Floats:
        """The next samples of the vibration.

        Parameters
        ----------
        speed_mm_s, force_n : (n,) array_like, or two scalars with `samples`
            Tangential speed (mm/s, either direction) and normal force (N) at each sample. NaN and
            infinite values count as lift-off and are counted.
        samples : int, optional
            Number of samples where speed and force are scalars.

        Returns
        -------
        (n,) ndarray
            Acceleration in the model's unit (g).

        Raises
        ------
        InputError
            For arrays of different lengths, or scalars without `samples`.
        """
        speed, force = _trajectory(speed_mm_s, force_n, samples)
        count = speed.size
        finite = np.isfinite(speed) & np.isfinite(force)
        self.counters.lift_offs += count - int(np.count_nonzero(finite))
        inputs = self._filter.inputs(self._key, self._position, count=count)
        starts = list(range(-self._position % self.update_samples, count, self.update_samples))
        self._position += count
        bounds = [*starts, count]
        output = self._filter.filter(self._setting, *(part[: bounds[0]] for part in inputs))
        settings = self._filter.settings(speed[starts], force[starts])
        self.counters.clamped = self._filter.clamped
        for start, stop, setting in zip(starts, bounds[1:], settings, strict=True):
            self._setting = setting
            output += self._filter.filter(setting, *(part[start:stop] for part in inputs))
        return np.array(output, dtype=np.float64)


def _trajectory(
    speed_mm_s: ArrayLike, force_n: ArrayLike, samples: int | None
) -> tuple[Floats, Floats]:
    speed = np.asarray(speed_mm_s, dtype=np.float64)
    force = np.asarray(force_n, dtype=np.float64)
    if speed.ndim == force.ndim == 0 and samples is not None and samples >= 0:
        return np.full(samples, float(speed)), np.full(samples, float(force))
    if speed.ndim != 1 or speed.shape != force.shape or samples is not None:
        raise InputError(
            "expected speed and force as two arrays of one length, or two scalars with samples=, "
            f"got shapes {speed.shape} and {force.shape} with samples={samples}; match them."
        )
    return speed, force
