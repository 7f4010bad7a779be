"""A model as the device takes it: the kernel's texture as bytes (docs/device.md#models)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.plan import Notch, plan_for
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.shared.setup.rig_file import DEVICE_RATE_HZ
from tactileq.rig.shared.wire.conversation import Hello

MOST_LAYERS = 8
CAPACITY_REALS = 2048
# What the device needs: no limit of a model may be infinite.
DEVICE_LIMITS = Limits(peak=5.0, rms=2.0, duration_s=60.0, pause_s=0.1)
ANY_DEVICE = Hello(
    DEVICE.who_am_i, DEVICE.firmware_version, DEVICE.schema_hash, DEVICE_RATE_HZ, 8, 0
)
_HEAD = struct.Struct("<4s4B3I4x")
_SCALARS = (
    "model_rate_hz",
    "speed_change",
    "force_change",
    "slope_share",
    "hold",
    "release",
    "peak",
    "mean_square",
    "mean_share",
    "silence",
    "notch_hz",
    "notch_width_hz",
    "notch_share",
)
_ARRAYS = ("speed_mm_s", "force_n", "signs", "slews", "values")
_LONGEST = 2**32 - 1


class UploadRange(NamedTuple):
    """From where to where a number of an upload may be, without an end that is `above` or `below`.

    Parameters
    ----------
    note : str
        What else holds.
    """

    low: float
    high: float
    above: bool = False
    below: bool = False
    note: str = ""

    def holds(self, values: Floats) -> NDArray[np.bool_]:
        """Which are in it; NaN is not."""
        low = values > self.low if self.above else values >= self.low
        high = values < self.high if self.below else values <= self.high
        both: NDArray[np.bool_] = low & high
        return both

    def __str__(self) -> str:
        if self.low == self.high:
            return f"of {self.low:g}"
        low, high = ">" if self.above else "≥", "<" if self.below else "≤"
        return f"{low} {self.low:g} and {high} {self.high:.10g}"


_ANY = 1e6
_MOST_GAIN_G, _MOST_PEAK_G = 1e3, 20.0
_NOTCH = UploadRange(1, 0.45 * DEVICE_RATE_HZ, note="where notch_share is above 0")
_AXIS = UploadRange(0, _ANY, above=True, note="each above the one before")
# As model.h has them; in the order of the upload, and of the values of ModelFault.
UPLOAD_RANGES = {
    "layers": UploadRange(0, MOST_LAYERS),
    "grid": UploadRange(2, 255, note="speeds and forces"),
    "update_samples": UploadRange(1, 1000),
    "longest": UploadRange(1, _LONGEST, note="samples"),
    "pause": UploadRange(1, _LONGEST, note="samples"),
    "model_rate_hz": UploadRange(DEVICE_RATE_HZ, DEVICE_RATE_HZ),
    "speed_change": UploadRange(0, _ANY),
    "force_change": UploadRange(0, _ANY),
    "slope_share": UploadRange(0, 1, above=True),
    "hold": UploadRange(0, _ANY),
    "release": UploadRange(0, _ANY),
    "peak": UploadRange(0, _MOST_PEAK_G, above=True),
    "mean_square": UploadRange(0, _MOST_PEAK_G**2, above=True),
    "mean_share": UploadRange(0, 1, above=True),
    "silence": UploadRange(0, 1, above=True),
    "notch_hz": _NOTCH,
    "notch_width_hz": _NOTCH,
    "notch_share": UploadRange(0, 1, below=True),
    "speed_mm_s": _AXIS,
    "force_n": _AXIS,
    "signs": UploadRange(-1, 1),
    "slews": UploadRange(0, _MOST_GAIN_G),
    "values": UploadRange(
        -_MOST_GAIN_G,
        _MOST_GAIN_G,
        note="gains; noise gains from 0 on; frequencies and bandwidths within ±1e+06",
    ),
}


@dataclass(frozen=True)
class DeviceModel:
    """An upload."""

    data: bytes

    @property
    def hash(self) -> int:
        """FNV-1a of the data, 64 bits."""
        value = 0xCBF29CE484222325
        for byte in self.data:
            value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
        return value


def device_model(
    model: AnyModel,
    hello: Hello,
    *,
    limits: Limits = DEVICE_LIMITS,
    compensation: Notch | None = None,
) -> DeviceModel:
    """A model for a device that said this of itself.

    Parameters
    ----------
    model : TextureModel or RegressedModel
        At the device's rate, with at most 8 layers.
    limits : Limits
        All of them finite.
    compensation : Compensation, optional
        Of the vibrator's resonance (eq. 7), at the device's rate.

    Raises
    ------
    InputError
        For an AR model, another rate, more layers or a larger grid than the device holds, a limit
        that is infinite, or numbers that single precision cannot hold.
    """
    if isinstance(model, ARModel):
        raise InputError(
            f"expected a model with layers for the device, got the AR model of {model.texture}; "
            "render it with the sound card, or fit a model to its spectrum."
        )
    if model.rate_hz != hello.tick_rate_hz:
        raise InputError(
            f"expected a model of {hello.tick_rate_hz:g} Hz for the device, got one of "
            f"{model.rate_hz:g} Hz; fit it at that rate."
        )
    if not np.isfinite([limits.peak, limits.rms, limits.duration_s]).all():
        raise InputError(
            "expected finite limits of peak, RMS and duration for a device, got an infinite one; "
            "give all three."
        )
    plan = plan_for(
        model.rate_hz,
        limits=limits,
        compensation=compensation,
        single=hello.real_size == 4,
    )
    fields = plan.texture(model)
    if fields["layers"] > MOST_LAYERS:
        raise InputError(
            f"expected at most {MOST_LAYERS} layers for the device, got {fields['layers']}; "
            "simplify the model (tactileq simplify)."
        )
    reals = [np.asarray([fields.get(name, 0.0) for name in _SCALARS])]
    reals += [np.ravel(fields[name]) for name in _ARRAYS]
    count = sum(part.size for part in reals) + _HEAD.size // hello.real_size
    if count > CAPACITY_REALS:
        raise InputError(
            f"expected a model of at most {CAPACITY_REALS} numbers for the device, got {count}; "
            "take a coarser grid of speeds and forces, or fewer layers (tactileq simplify)."
        )
    _check_ranges(fields)
    head = _HEAD.pack(
        b"TQM1",
        hello.real_size,
        fields["layers"],
        fields["speeds"],
        fields["forces"],
        fields["update_samples"],
        min(fields["longest"], _LONGEST),
        min(fields["pause"], _LONGEST),
    )
    kind = np.dtype("<f4" if hello.real_size == 4 else "<f8")
    return DeviceModel(head + b"".join(part.astype(kind).tobytes() for part in reals))


def _check_ranges(fields: Mapping[str, Any]) -> None:
    """Refuse what the device would."""
    gains = 1 + 2 * fields["layers"]
    for name in (*_SCALARS, *_ARRAYS):
        given, within = np.atleast_1d(fields.get(name, 0.0)), UPLOAD_RANGES[name]
        if within is _NOTCH and not fields.get("notch_share", 0.0):
            continue
        if name == "values":
            given = given.reshape(-1, gains + fields["layers"])[:, gains:]
        if (wrong := given[~within.holds(given)]).size:
            raise InputError(
                f"expected {name} of a model for the device {within}, got {wrong[0]:g}; change the "
                "limits or the compensation, or fit the model again."
            )
