"""Rendering a texture model as a stroke goes on."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from modeling.arrays import Floats
from modeling.errors import InputError
from modeling.models.ar_model import ARModel
from modeling.rendering.compiled import CompiledEngine, is_compiled
from modeling.rendering.limits import Limits
from modeling.rendering.noise import stream_key
from modeling.rendering.plan import UPDATE_S, LayeredModel, Notch, RenderCounters, RenderPlan
from modeling.rendering.reference.bands import BandFilter
from modeling.rendering.reference.engine import PythonEngine
from modeling.rendering.reference.lattice import LatticeFilter


class Engine(Protocol):
    """What runs the filters of one stream."""

    @property
    def counters(self) -> RenderCounters: ...

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats: ...


class Renderer:
    """Vibration of a texture model under a moving hand (eq. 1–2, docs/method/rendering.md).

    The state carries on from call to call: rendering in blocks of any size gives the same bits.
    Layered models run through the compiled kernel (`kernel.h`), or, where there is none, through
    Python with the same bits; an ARModel always runs in Python.

    At each update the hand is extrapolated by its slope over the last 4 ms (but a change beyond any
    hand's, 20 m/s² or 200 N/s, is a step): frequencies and bandwidths are those for the middle of
    the time to the next update, and gains ramp linearly to those for its end. The largest
    of the model's gains takes 5 ms at least from silence or to it, so that nothing clicks.

    Parameters
    ----------
    model : TextureModel, RegressedModel or ARModel
        What to render.
    rate_hz : float, optional
        Output rate, at least the model's (the default). Peaks and widths stay the same: w gets the
        variance rate/model rate and the noise branch ends at the model's Nyquist frequency. Skirts
        that come close to that frequency do not, as the filter warps less: third octaves of the
        planted textures differ by −0.7 to +3.2 dB at 48 kHz, their whole level by up to 0.15 dB.
        For the very spectrum render at the model's rate and resample, as stimulus sets do. An
        ARModel is rendered at its own rate only.
    seed, stream : int
        Which noise; two renderers with the same pair give the same signal.
    update_samples : int, optional
        Samples from one reading of speed and force to the next, 1 … 1 000 000; by default one
        millisecond (5 at 5 kHz, docs/method/rendering.md#moving-parameters). Where a device reads
        less often, its period.
    limits : Limits, optional
        Peak, RMS and duration that the output does not exceed; none by default.
    compensation : Compensation, optional
        Undoes the resonance of the vibrator that will play the output (eq. 7), before the limits;
        made for this rate.

    Raises
    ------
    InputError
        For a rate below the model's, or another one than an ARModel's; for a compensation made for
        another rate; for `update_samples` out of range.
    """

    def __init__(
        self,
        model: LayeredModel | ARModel,
        *,
        rate_hz: float | None = None,
        seed: int = 0,
        stream: int = 0,
        update_samples: int | None = None,
        limits: Limits | None = None,
        compensation: Notch | None = None,
    ) -> None:
        self.model = model
        self.rate_hz = model.rate_hz if rate_hz is None else float(rate_hz)
        key = stream_key(seed, stream)
        if update_samples is None:
            finite = np.isfinite(self.rate_hz)
            update_samples = max(1, round(UPDATE_S * self.rate_hz)) if finite else 1
        self.plan = plan = RenderPlan(
            rate_hz=self.rate_hz,
            update_samples=update_samples,
            limits=limits or Limits(),
            compensation=compensation,
        )
        self.update_samples = plan.update_samples
        self._engine: Engine
        if isinstance(model, ARModel):
            self._engine = PythonEngine(LatticeFilter(model, plan), plan, key=key)
        elif is_compiled():
            self._engine = CompiledEngine(model, plan, key=key)
        else:
            self._engine = PythonEngine(BandFilter(model, plan), plan, key=key)

    @property
    def counters(self) -> RenderCounters:
        """What the renderer had to correct so far."""
        return self._engine.counters

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
        return self._engine.render(*_checked(speed_mm_s, force_n, samples))


def _checked(
    speed_mm_s: ArrayLike, force_n: ArrayLike, samples: int | None
) -> tuple[Floats, Floats]:
    # No `Hand`: making one costs a tenth of a call of 32 samples.
    speed = np.asarray(speed_mm_s, dtype=np.float64, order="C")
    force = np.asarray(force_n, dtype=np.float64, order="C")
    if speed.ndim == force.ndim == 0 and samples is not None and samples >= 0:
        return np.full(samples, float(speed)), np.full(samples, float(force))
    if speed.ndim != 1 or speed.shape != force.shape or samples is not None:
        raise InputError(
            "expected speed and force as two arrays of one length, or two scalars with samples=, "
            f"got shapes {speed.shape} and {force.shape} with samples={samples}; match them."
        )
    return speed, force
