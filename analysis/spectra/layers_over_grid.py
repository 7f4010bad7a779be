"""A model's layers over speed, and over the whole grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactileq.modeling import InputError, TextureModel
from tactileq.modeling.arrays import Bools, Floats
from tactileq.modeling.errors import shown
from tactileq.modeling.perception.amplitudes import layer_amplitudes_g


def _grid_index(model: TextureModel, speed_mm_s: float, *, force_n: float) -> tuple[int, int]:
    speed = np.flatnonzero(model.speeds_mm_s == speed_mm_s)
    force = np.flatnonzero(model.forces_n == force_n)
    if not (speed.size and force.size):
        raise InputError(
            f"expected a condition of the grid of {shown(model.texture)}, got {speed_mm_s:g} mm/s "
            f"and {force_n:g} N; choose among {model.speeds_mm_s.tolist()} mm/s and "
            f"{model.forces_n.tolist()} N."
        )
    return int(speed[0]), int(force[0])


@dataclass(frozen=True, eq=False)
class LayersOverSpeed:
    """Frequency and amplitude of each layer over speed, at one force.

    Parameters
    ----------
    label : str
        Whose layers these are.
    unit : str
        Of the amplitudes: g, or arbitrary.
    speeds_mm_s : (S,) ndarray
    frequency_hz, amplitude : (S, m) ndarray
        Amplitude of the sinusoid of equal power, √2·G·√(k/(1+k)), peak
        (docs/method/perception.md#criteria).
    """

    label: str
    texture: str
    force_n: float
    simulated: bool
    unit: str
    speeds_mm_s: Floats
    frequency_hz: Floats
    amplitude: Floats


def layers_over_speed(model: TextureModel, *, force_n: float) -> LayersOverSpeed:
    """Follow the layers of a model over its speeds, at one force (N) of its grid."""
    force = _grid_index(model, float(model.speeds_mm_s[0]), force_n=force_n)[1]
    return LayersOverSpeed(
        label=model.estimator,
        texture=model.texture,
        force_n=force_n,
        simulated=model.simulated,
        unit=model.unit,
        speeds_mm_s=model.speeds_mm_s,
        frequency_hz=model.frequencies_hz[:, force],
        amplitude=layer_amplitudes_g(model, criterion="energy")[:, force],
    )


@dataclass(frozen=True, eq=False)
class LayersOverGrid:
    """Frequency and amplitude of each layer in every condition, with what was not measured marked.

    Parameters
    ----------
    unit : str
        Of the amplitudes: g, or arbitrary.
    speeds_mm_s : (S,) ndarray
    forces_n : (F,) ndarray
    frequency_hz, amplitude : (S, F, m) ndarray
        Amplitude of the sinusoid of equal power, √2·G·√(k/(1+k)), peak
        (docs/method/perception.md#criteria).
    mean_frequency_hz, mean_amplitude : (S, m) ndarray
        Over the forces.
    inherited, unresolved : (S, F, m) ndarray of bool
        No peak of its own there; width or level a bound (docs/method/fitting.md#inherited,
        #unresolved).
    interpolated : (S, F) ndarray of bool
        Condition without a recording.
    """

    texture: str
    estimator: str
    simulated: bool
    unit: str
    speeds_mm_s: Floats
    forces_n: Floats
    frequency_hz: Floats
    amplitude: Floats
    mean_frequency_hz: Floats
    mean_amplitude: Floats
    inherited: Bools
    unresolved: Bools
    interpolated: Bools


def layers_over_grid(model: TextureModel) -> LayersOverGrid:
    """The layers of a model over its grid."""
    amplitude = layer_amplitudes_g(model, criterion="energy")
    return LayersOverGrid(
        texture=model.texture,
        estimator=model.estimator,
        simulated=model.simulated,
        unit=model.unit,
        speeds_mm_s=model.speeds_mm_s,
        forces_n=model.forces_n,
        frequency_hz=model.frequencies_hz,
        amplitude=amplitude,
        mean_frequency_hz=model.frequencies_hz.mean(axis=1),
        mean_amplitude=amplitude.mean(axis=1),
        inherited=model.inherited,
        unresolved=model.unresolved,
        interpolated=model.interpolated,
    )
