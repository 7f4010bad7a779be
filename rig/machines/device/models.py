"""A model as the device takes it: the kernel's texture as bytes (docs/device.md#models)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

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
