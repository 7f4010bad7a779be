"""Rendering a texture model as a stroke goes on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import is_number, is_whole
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.rendering.compiled import CompiledEngine, is_compiled
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import (
    LayeredModel,
    Notch,
    RenderCounters,
    plan_for,
    usual_update_s,
)
from tactileq.modeling.rendering.reference.bands import BandFilter
from tactileq.modeling.rendering.reference.engine import PythonEngine
from tactileq.modeling.rendering.reference.lattice import LatticeFilter

MOST_SAMPLES = 2**31  # of one call
Real = TypeVar("Real", np.float64, np.float32)


class Engine(Protocol):
    """What runs the filters of one stream."""

    @property
    def counters(self) -> RenderCounters: ...

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats: ...

    def read(self, ago: float, speed_mm_s: float, force_n: float) -> None: ...

    def render_on(self, samples: int) -> Floats: ...


class Renderer:
    """Vibration of a texture model under a moving hand (eq. 1–2, docs/method/rendering.md).

    The state carries on from call to call: rendering in blocks of any size gives the same bits.
    Layered models run in the compiled kernel (`kernel.h`) or, without it, in Python with
    bit-identical results; an ARModel always runs in Python.

    At each update the hand is extrapolated by its slope over the last 4 ms (but a change that no
    hand can make, beyond 20 m/s² or 200 N/s, is a step): frequencies and bandwidths are those for
    the middle of the time to the next update, and gains ramp linearly to those for its end. The
    largest of the model's gains takes at least 5 ms from silence or to it, so that nothing clicks.

    Parameters
    ----------
    model : TextureModel, RegressedModel or ARModel
        What to render.
    rate_hz : float, optional
        Output rate, at least the model's (the default). All is rendered at the model's rate and
        interpolated, which keeps the spectrum within 0.06 dB up to 0.9 of the model's Nyquist
        frequency and is late by `delay_s` (docs/method/rendering.md#other-rates). The ratio to
        twice the model's rate is one of whole numbers up to 4000.
    seed, stream : int
        Which noise; two renderers with the same pair give the same signal.
    update_samples : int, optional
        Samples of the output from one parameter update to the next, 1 … 1 000 000, in effect the
        nearest whole number of samples at the model's rate, at least 1; by default one millisecond
        (5 at 5 kHz, docs/method/rendering.md#moving-parameters), of a model that was compiled for a
        scene the interval that keeps the scene's bound. `render` reads speed and force at each
        update; readings at times of their own are for `read` and `render_on`.
    limits : Limits, optional
        Peak, RMS and duration that the output does not exceed; none by default.
    compensation : Compensation, optional
        Compensates the resonance of the vibrator that plays the output (eq. 7), before the limits;
        made for this rate.
    single : bool
        Everything in single precision, as on a micro-controller (docs/method/rendering.md#kernel):
        by the compiled kernel only.

    Raises
    ------
    InputError
        For a rate below the model's, or in no such ratio to it; for a compensation made for
        another rate; for `update_samples` out of range; for single precision of an ARModel, of
        numbers that it cannot hold or tell apart, or without the compiled kernel.
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
        single: bool = False,
    ) -> None:
        self.model = model
        key = stream_key(seed, stream)
        self.plan = plan = plan_for(
            model.rate_hz,
            rate_hz=rate_hz,
            update_samples=update_samples,
            update_s=usual_update_s(model),
            limits=limits,
            compensation=compensation,
            single=single,
        )
        self.rate_hz, self.update_samples = plan.rate_hz, plan.update_samples
        self._engine: Engine
        self._call: Callable[..., Any] = _converted
        if not isinstance(model, ARModel) and is_compiled():
            self._engine = engine = CompiledEngine(model, plan, key=key)
            self._call = engine.call
        elif single:
            raise InputError(
                "expected a layered model and the compiled kernel for single precision, got an "
                "autoregressive model or no kernel; take double precision."
            )
        elif isinstance(model, ARModel):
            self._engine = PythonEngine(LatticeFilter(model, plan), plan, key=key)
        else:
            self._engine = PythonEngine(BandFilter(model, plan), plan, key=key)

    def __repr__(self) -> str:
        return f"<Renderer of a {type(self.model).__name__} at {self.rate_hz:g} Hz>"

    @property
    def counters(self) -> RenderCounters:
        """What the renderer had to correct so far."""
        return self._engine.counters

    @property
    def delay_s(self) -> float:
        """By how much the output is late at low frequencies; 0 at the model's rate."""
        return self.plan.delay_s

    @overload
    def render(
        self,
        speed_mm_s: ArrayLike,
        force_n: ArrayLike,
        *,
        samples: int | None = None,
        out: None = None,
    ) -> Floats: ...
    @overload
    def render(
        self,
        speed_mm_s: ArrayLike,
        force_n: ArrayLike,
        *,
        samples: int | None = None,
        out: NDArray[Real],
    ) -> NDArray[Real]: ...
    def render(
        self,
        speed_mm_s: ArrayLike,
        force_n: ArrayLike,
        *,
        samples: int | None = None,
        out: NDArray[Any] | None = None,
    ) -> NDArray[Any]:
        """The next samples of the vibration.

        A call is cheapest (docs/method/rendering.md#cost) with two floats or contiguous arrays of
        float64, and with `out`.

        Parameters
        ----------
        speed_mm_s, force_n : (n,) array_like, or two scalars with `samples` or `out`
            Tangential speed (mm/s; its sign is the direction) and normal force (N) at each sample.
            Signed speed is better than |v|, which is extrapolated past its corner where the hand
            turns (docs/method/rendering.md#extrapolation). NaN and infinite values count as
            missing and are counted: the reading before is held for 20 ms, then the hand is lifted
            off. Contact ends 3 ms after the first force of 0 or less
            (docs/method/rendering.md#readings).
        samples : int, optional
            Number of samples where speed and force are scalars; by default the size of `out`.
        out : (n,) ndarray of float64 or float32, optional
            Where to render to: writable and contiguous. The caller's array may be used again for
            the next call, and may be that of the speeds or forces.

        Returns
        -------
        (n,) ndarray
            Acceleration in the model's unit (g): `out`, or a new array of float64.

        Raises
        ------
        InputError
            For arrays of different lengths, scalars without a number of samples, or another `out`.
        RuntimeError
            For a call while another thread renders with the same compiled renderer.
        """
        rendered: NDArray[Any] | None = self._call(speed_mm_s, force_n, samples, out)
        if rendered is not None:
            return rendered
        count = out.size if samples is None and isinstance(out, np.ndarray) else samples
        speed, force = _checked(speed_mm_s, force_n, samples=samples, count=count)
        if out is None:
            return self._engine.render(speed, force)
        _check_out(out, speed.size)
        out[:] = self._engine.render(speed, force)
        return out

    def read(self, speed_mm_s: float, force_n: float, *, ago: float = 0.0) -> None:
        """Take in a reading of the hand that was made at a time of its own, for `render_on`.

        Parameters
        ----------
        speed_mm_s, force_n : float
            Tangential speed (mm/s; its sign is the direction) and normal force (N). One that is not
            finite is ignored, as if it had not come.
        ago : float
            How many samples before the next one it was made, fractions included; ≥ 0. Readings come
            in the order of their times: one that is not later than the last one is ignored.

        Raises
        ------
        InputError
            For what is no number, and a time below 0 (in the future) or not finite.
        RuntimeError
            While another thread renders with the same compiled renderer.
        """
        if not (is_number(ago) and 0 <= ago < np.inf):
            raise InputError(
                "expected the time since a reading as a number of samples, 0 or more, got "
                f"{shown(ago)}; a reading is made before it is used."
            )
        speed, force = as_floats(speed_mm_s, force_n)
        if speed.ndim or force.ndim:
            raise InputError(
                "expected one speed and one force of a reading, got shapes "
                f"{speed.shape} and {force.shape}; call read for each reading."
            )
        self._engine.read(float(ago), float(speed), float(force))

    def render_on(self, samples: int) -> Floats:
        """The next samples for the hand as it was last `read`, extrapolated from that time.

        A reading counts for 20 ms. Before the first one, and when none counts any more, the hand is
        lifted off (docs/method/rendering.md#readings).

        Parameters
        ----------
        samples : int
            0 or more; any division into calls gives the same bits.

        Returns
        -------
        (samples,) ndarray
            Acceleration in the model's unit (g).

        Raises
        ------
        InputError
            For another number of samples.
        RuntimeError
            For a call while another thread renders with the same compiled renderer.
        """
        _check_samples(samples)
        return self._engine.render_on(int(samples))


def _converted(*arguments: object) -> None:
    """In place of an engine's call that takes some arguments as they are."""


def as_floats(speed_mm_s: ArrayLike, force_n: ArrayLike) -> tuple[Floats, Floats]:
    """Speed and force as arrays of float64; InputError for what is no numbers."""
    try:
        speed = np.asarray(speed_mm_s, dtype=np.float64, order="C")
        force = np.asarray(force_n, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        raise InputError(
            f"expected speed and force as numbers, got {shown(speed_mm_s)} and {shown(force_n)}; "
            "give mm/s and N."
        ) from None
    return speed, force


def _checked(
    speed_mm_s: ArrayLike, force_n: ArrayLike, *, samples: int | None, count: int | None
) -> tuple[Floats, Floats]:
    speed, force = as_floats(speed_mm_s, force_n)
    if samples is not None:
        _check_samples(samples)
    if speed.ndim == force.ndim == 0 and count is not None:
        return np.full(count, float(speed)), np.full(count, float(force))
    if speed.ndim != 1 or speed.shape != force.shape or samples is not None:
        raise InputError(
            "expected speed and force as two arrays of one length, or two scalars with samples=, "
            f"got shapes {speed.shape} and {force.shape} with samples={samples}; match them."
        )
    return speed, force


def _check_samples(samples: int) -> None:
    if not (is_whole(samples) and 0 <= samples <= MOST_SAMPLES):
        raise InputError(
            f"expected samples as a whole number of 0 … {MOST_SAMPLES}, got {shown(samples)}; "
            "render more in several calls."
        )


def _check_out(out: NDArray[Any], count: int) -> None:
    right = isinstance(out, np.ndarray) and out.dtype in (np.float64, np.float32)
    if not (right and out.shape == (count,) and out.flags.carray):
        got = f"{out.dtype} of shape {out.shape}" if isinstance(out, np.ndarray) else shown(out)
        raise InputError(
            f"expected out as a writable, contiguous array of {count} float64 or float32, got "
            f"{got}; allocate it by np.empty({count})."
        )
