"""What is rendered and how: everything on which the compiled and the Python renderer must agree."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import is_whole
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.modeling.models.parameter_table import ParameterTable
from tactileq.modeling.rendering.cost import Cost, cost_of
from tactileq.modeling.rendering.interpolation import Interpolation, interpolation
from tactileq.modeling.rendering.limits import Limits

UPDATE_S = 1e-3
FADE_S = 5e-3
# Over which the slope of a reading is smoothed before the hand is extrapolated by it.
SLOPE_S = 4e-3
# A reading that changes faster is a step of the device, not a hand's motion (2 g; a sharp tap).
FASTEST_SPEED_CHANGE_MM_S2 = 2e4
FASTEST_FORCE_CHANGE_N_S = 200.0
# How long the hand is extrapolated from a reading where none follows.
HOLD_S = 20e-3
# How long there must have been no contact until it counts as ended: sensors miss it for a moment.
RELEASE_S = 3e-3
_LONGEST_UPDATE = 1_000_000
_FOR_EVER = 2**62
_LARGEST_EXCESS = 0.05  # of a mean square in single precision


class LayeredModel(Protocol):
    """A model that gives PEQ parameters for any speed and force."""

    @property
    def rate_hz(self) -> float: ...

    @property
    def table(self) -> ParameterTable: ...


class Notch(Protocol):
    """A vibrator compensation (eq. 7): the signal less a share of it in a unit-gain band."""

    @property
    def rate_hz(self) -> float: ...

    @property
    def frequency_hz(self) -> float: ...

    @property
    def bandwidth_hz(self) -> float: ...

    @property
    def band_share(self) -> float: ...


@dataclass
class RenderCounters:
    """What a renderer had to correct so far.

    `lift_offs`: samples with a speed or force that is not finite; of readings with times of their
    own, samples for which none counts. `above_grid`: samples while the
    hand, as last read, touched and moved faster or pressed harder than the highest condition of the
    model's grid; `below_grid`: or else slower or more lightly than the lowest, but not at rest.
    `clamped`: parameter values moved into the legal range. The rest: samples that each of the
    `Limits` touched. All samples are those of the output.
    """

    lift_offs: int = 0
    above_grid: int = 0
    below_grid: int = 0
    clamped: int = 0
    limited_peak: int = 0
    limited_rms: int = 0
    limited_duration: int = 0


@dataclass(frozen=True, eq=False, kw_only=True)
class RenderPlan:
    """How a stream is rendered.

    Parameters
    ----------
    rate_hz : float
        Of the output.
    update_samples : int
        Of the output, from one parameter update to the next, 1 … 1 000 000; at another rate than
        the model's rounded to whole samples of the model, at least one.
    model_rate_hz : float, optional
        At most the output's, which is the default.
    limits : Limits
        None by default.
    compensation : Notch, optional
        At this rate.
    single : bool
        In single precision instead of double.
    hold_s : float
        How long a reading of the hand counts where none follows.

    Raises
    ------
    InputError
        For an update period out of range, or a compensation for another rate; for rates that
        `interpolation` refuses.
    """

    rate_hz: float
    update_samples: int
    model_rate_hz: float | None = None
    limits: Limits = field(default_factory=Limits)
    compensation: Notch | None = None
    single: bool = False
    hold_s: float = HOLD_S

    def __post_init__(self) -> None:
        if not (is_whole(self.update_samples) and 1 <= self.update_samples <= _LONGEST_UPDATE):
            raise InputError(
                f"expected parameter updates every 1 to {_LONGEST_UPDATE} samples, got "
                f"{shown(self.update_samples)}; give a whole number of update_samples in that "
                "range."
            )
        if self.compensation is not None and self.compensation.rate_hz != self.rate_hz:
            raise InputError(
                f"expected a vibrator compensation for {self.rate_hz:g} Hz, got one for "
                f"{self.compensation.rate_hz:g} Hz; make it for the rate of rendering."
            )
        self.interpolation  # noqa: B018  (refuses rates)

    @cached_property
    def interpolation(self) -> Interpolation | None:
        """How the output comes from samples at the model's rate; None where that is its own."""
        return interpolation(self.own_rate_hz, self.rate_hz)

    @property
    def own_rate_hz(self) -> float:
        """The model's."""
        return self.rate_hz if self.model_rate_hz is None else self.model_rate_hz

    @property
    def own(self) -> RenderPlan:
        """How samples at the model's rate are made, before interpolation, compensation, limits."""
        if self.interpolation is None:
            return self
        samples = max(1, round(self.update_samples * self.own_rate_hz / self.rate_hz))
        return RenderPlan(
            rate_hz=self.own_rate_hz,
            update_samples=samples,
            single=self.single,
            hold_s=self.hold_s,
        )

    @property
    def delay_s(self) -> float:
        """By how much the output is late at low frequencies: the interpolation's group delay.

        For it the hand is extrapolated; what cannot be foreseen, such as a lift-off, is felt late.
        """
        interpolated = self.interpolation
        return interpolated.delay_samples / self.own_rate_hz if interpolated else 0.0

    @property
    def lead(self) -> float:
        """The delay in parameter updates."""
        own = self.own
        return self.delay_s * own.rate_hz / own.update_samples

    @property
    def precision(self) -> type[np.floating[Any]]:
        """Of every number that is computed."""
        return np.float32 if self.single else np.float64

    @property
    def hand_changes(self) -> tuple[float, float]:
        """Largest change of a hand's speed (mm/s) and force (N) in one update."""
        update_s = self.update_samples / self.rate_hz
        return FASTEST_SPEED_CHANGE_MM_S2 * update_s, FASTEST_FORCE_CHANGE_N_S * update_s

    @property
    def slope_share(self) -> float:
        """How much of a new change of a reading counts at once towards its smoothed slope."""
        return min(1.0, self.update_samples / (SLOPE_S * self.rate_hz))

    @property
    def readings(self) -> dict[str, float]:
        """What `tq_texture` holds of readings, in samples at the plan's rate.

        docs/method/rendering.md#readings; a texture has those of `own`.
        """
        return {"hold": self.hold_s * self.rate_hz, "release": RELEASE_S * self.rate_hz}

    @property
    def mean_share(self) -> float:
        """What a new square adds to the running mean square."""
        return float(-np.expm1(-1 / (self.limits.rms_window_s * self.rate_hz)))

    def slews(self, largest_gains: Floats) -> Floats:
        """How far each of (k,) gains moves in one update at most, (k,), given the largest it has.

        The largest takes 5 ms: no hand is faster, but sensors and lift-off are.
        """
        share = min(1.0, self.update_samples / (FADE_S * self.rate_hz))
        share *= 1 + 1e-12  # five fifths are to be a whole, whatever they round to
        return largest_gains * share

    def cost(self, model: LayeredModel) -> Cost:
        """What rendering a model costs, in counted operations and bytes; refused as `texture`."""
        fields, own = self.texture(model), self.own
        return cost_of(
            layers=fields["layers"],
            interpolated=self.interpolation is not None,
            samples_per_output=own.rate_hz / self.rate_hz,
            update_samples=own.update_samples,
            compensated=self.compensation is not None and self.compensation.band_share != 0,
            rms_limited=bool(np.isfinite(self.limits.rms)),
            numbers=sum(np.size(value) for value in fields.values() if np.ndim(value)),
            real_bytes=np.dtype(self.precision).itemsize,
        )

    def texture(self, model: LayeredModel) -> dict[str, Any]:
        """Everything that `tq_texture` in `kernel.h` holds, by name and in its order.

        In single precision the nearest such numbers.

        Raises
        ------
        InputError
            For numbers that single precision cannot hold or tell apart; for a model of another rate
            than the plan's.
        """
        fields = self._texture(model)
        if not self.single:
            return fields
        return {name: _in_single(name, value) for name, value in fields.items()}

    def _texture(self, model: LayeredModel) -> dict[str, int | float | Floats]:
        if model.rate_hz != self.own_rate_hz:
            raise InputError(
                f"expected a model of {self.own_rate_hz:g} Hz, got one of {model.rate_hz:g} Hz; "
                "make the plan for the model's rate."
            )
        table = model.table
        fields: dict[str, int | float | Floats] = {
            "speeds": table.speeds_mm_s.size,
            "forces": table.forces_n.size,
            "layers": table.n_layers,
            "speed_mm_s": table.speeds_mm_s,
            "force_n": table.forces_n,
            "values": table.values.reshape(-1, table.values.shape[-1]),
            "signs": table.signs,
        }
        return fields | self.timing(table.largest_gains) | self.restraints()

    def timing(self, largest_gains: Floats) -> dict[str, Any]:
        """What `tq_texture` holds of rates, updates and the hand, for (k,) gains."""
        own, way = self.own, self.interpolation
        fields: dict[str, Any] = {"model_rate_hz": own.rate_hz, "rate_hz": self.rate_hz}
        if way is not None:
            fields |= {"up": way.up, "down": way.down}
            fields |= {"doubling": way.doubling, "phases": way.phases, "lead": self.lead}
        speed_change, force_change = own.hand_changes
        return fields | {
            "update_samples": own.update_samples,
            "speed_change": speed_change,
            "force_change": force_change,
            "slope_share": own.slope_share,
            **own.readings,
            "slews": own.slews(largest_gains),
        }

    def restraints(self) -> dict[str, Any]:
        """What `tq_texture` holds of compensation and limits.

        Only those that there are: without them the structure's zeros stand for none.
        """
        fields: dict[str, Any] = {}
        if self.compensation is not None:
            fields["notch_hz"] = self.compensation.frequency_hz
            fields["notch_width_hz"] = self.compensation.bandwidth_hz
            fields["notch_share"] = self.compensation.band_share
        if np.isfinite(self.limits.peak):
            fields["peak"] = self.limits.peak
        if np.isfinite(self.limits.rms):
            fields["mean_square"] = self.limits.mean_square * self._kept_by_rounding
            fields["mean_share"] = self.mean_share
        if np.isfinite(self.limits.duration_s):
            fields["longest"] = self.samples(self.limits.duration_s)
            fields["pause"] = self.samples(self.limits.pause_s)
            fields["silence"] = self.limits.silence
        return fields

    @property
    def _kept_by_rounding(self) -> float:
        """By which factor to lower a limit of the mean square, so that rounding does not exceed it.

        At each sample single precision rounds the running mean square by up to two of its epsilons,
        and 1/`mean_share` samples count; in double precision that is below any tolerance.
        """
        if not self.single:
            return 1.0
        excess = 2 * float(np.finfo(np.float32).eps) / self.mean_share
        if excess > _LARGEST_EXCESS:
            longest = self.limits.rms_window_s * _LARGEST_EXCESS / excess
            raise InputError(
                f"expected a window of the RMS limit of at most {longest:.3g} s for single "
                f"precision at {self.rate_hz:g} Hz, got {self.limits.rms_window_s:g}; shorten it "
                "or take double precision."
            )
        return 1 - excess

    def samples(self, seconds: float) -> int:
        """A limit's time in samples, at least 1; 0 stands for no limit."""
        return 0 if np.isinf(seconds) else max(1, round(min(seconds * self.rate_hz, _FOR_EVER)))


def usual_update_s(model: object) -> float:
    """From one parameter update to the next by default: 1 ms, or what a model was compiled for."""
    compiled_for = getattr(model, "compiled_for", None)
    return compiled_for.update_s if isinstance(compiled_for, CompiledFor) else UPDATE_S


def plan_for(
    model_rate_hz: float,
    *,
    rate_hz: float | None = None,
    update_samples: int | None = None,
    update_s: float = UPDATE_S,
    limits: Limits | None = None,
    compensation: Notch | None = None,
    single: bool = False,
    hold_s: float = HOLD_S,
) -> RenderPlan:
    """The plan of a `Renderer` with these arguments, of a model at this rate; refused as there.

    `update_s` applies where no `update_samples` are given (`usual_update_s`).
    """
    rate_hz = model_rate_hz if rate_hz is None else float(rate_hz)
    if update_samples is None:
        update_samples = max(1, round(update_s * rate_hz)) if np.isfinite(rate_hz) else 1
    return RenderPlan(
        rate_hz=rate_hz,
        update_samples=update_samples,
        model_rate_hz=model_rate_hz,
        limits=limits or Limits(),
        compensation=compensation,
        single=single,
        hold_s=hold_s,
    )


def _in_single(member: str, value: int | float | Floats) -> int | np.float32 | NDArray[np.float32]:
    """A member of `tq_texture` in single precision; counts stay as they are."""
    if isinstance(value, int):
        return value
    with np.errstate(over="ignore"):
        rounded = np.asarray(value, dtype=np.float32)
    axis = member in ("speed_mm_s", "force_n")
    told_apart = not axis or (np.diff(rounded, prepend=0) > 0).all()
    # As a scalar 0 stands for none: a limit must not vanish.
    vanished = np.ndim(value) == 0 and value != 0 and rounded == 0
    if vanished or not (told_apart and np.isfinite(rounded).all()):
        raise InputError(
            f"expected numbers that single precision can hold and tell apart, got others in "
            f"{member}; take double precision."
        )
    return rounded[()]  # a scalar where it was one
