"""The texture model: PEQ parameters over a grid of speeds and forces."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from modeling.arrays import Bools, Floats
from modeling.checks import UNITS, check_rate, check_texture_name, is_number
from modeling.equalizer.bands import check_bands, clamp_bands
from modeling.equalizer.peq import PEQ
from modeling.errors import InputError, shown
from modeling.files.saved_model import SavedModel
from modeling.models.compiled_for import CompiledFor
from modeling.models.fit_summary import FitSummary
from modeling.models.grid import check_axes
from modeling.models.parameter_table import (
    Parameters,
    ParameterTable,
    logarithmic_nodes,
    wide_enough,
)

Blending = Literal["linear", "logarithmic"]
BLENDINGS: tuple[Blending, ...] = ("linear", "logarithmic")
# Above this a layer's level is not identifiable (docs/method/fitting.md#not-identifiable).
LARGEST_IDENTIFIABLE_SD_DB = 6.0


def _no_marks() -> Bools:
    return np.zeros(0, dtype=bool)


@dataclass(frozen=True, eq=False, kw_only=True)
class TextureModel(SavedModel):
    """PEQ parameters of one texture over a rectangular grid of S speeds × F forces, m layers.

    Parameters
    ----------
    texture : str
        Name of the surface.
    rate_hz : float
        The rate at which the driving noise has unit variance.
    speeds_mm_s : (S,) array_like
        Rising, > 0, S ≥ 1; of one speed alone nothing is known of others.
    forces_n : (F,) array_like
        Rising, > 0, F ≥ 1.
    noise_gains : (S, F) array_like
        G_w ≥ 0, in `unit` per unit noise.
    frequencies_hz, bandwidths_hz, gains : (S, F, m) array_like
        As in `PEQ`; gains are signed.
    level_sd_db : (S, F, m) array_like
        Standard deviation of each layer's level in dB, from the estimator (0: known exactly).
    estimator : str
        What made the model ("paper", "paper-consistent", "planted", …).
    unit : {"g", "arbitrary"}
    simulated : bool
        True where the recordings behind it were simulated.
    inherited, unresolved : (S, F, m) array_like of bool, optional
        Frequency taken over from the reference condition; width or level not resolved (see
        `modeling.Layers`).
    interpolated : (S, F) array_like of bool, optional
        Condition without a recording, filled from its neighbours.
    blending : {"linear", "logarithmic"}
        How parameters are read between conditions: linearly over speed and force, or as powers of
        both (docs/method/rendering.md#blending), for which no layer may change its sign. A file
        without it means linear.
    compiled_for : CompiledFor, optional
        The scene that the model was compiled for, with the bound that it keeps there.
    simplified_from : str
        SHA-256 of the full model, where `simplify` dropped layers of it; else empty.
    fit : FitSummary, optional
        What the estimator says of its fit; of a model with fewer layers or other nodes it says
        nothing.

    Raises
    ------
    InputError
        For wrong shapes or values out of range.
    """

    FORMAT = "tactileq.texture-model"
    OPTIONAL = frozenset({"blending", "compiled_for", "fit", "simplified_from"})

    texture: str
    rate_hz: float
    speeds_mm_s: Floats
    forces_n: Floats
    noise_gains: Floats
    frequencies_hz: Floats
    bandwidths_hz: Floats
    gains: Floats
    level_sd_db: Floats
    estimator: str
    unit: str = "g"
    simulated: bool = False
    inherited: Bools = field(default_factory=_no_marks)
    unresolved: Bools = field(default_factory=_no_marks)
    interpolated: Bools = field(default_factory=_no_marks)
    blending: Blending = "linear"
    compiled_for: CompiledFor | None = None
    simplified_from: str = ""
    fit: FitSummary | None = None

    def __post_init__(self) -> None:
        self._check_kinds()
        object.__setattr__(self, "compiled_for", CompiledFor.of(self.compiled_for))
        object.__setattr__(self, "fit", FitSummary.of(self.fit))
        self._freeze(("gains",))
        shape = np.shape(self.gains)
        for name in _BOOLEAN_ARRAYS:
            if np.size(getattr(self, name)) == 0:
                unmarked = np.zeros(shape[:2] if name == "interpolated" else shape, dtype=bool)
                object.__setattr__(self, name, unmarked)
        self._freeze(_ARRAYS, booleans=_BOOLEAN_ARRAYS)
        self._check_axes()
        self._check_values()
        object.__setattr__(self, "rate_hz", float(self.rate_hz))

    def _check_axes(self) -> None:
        check_axes(self.speeds_mm_s, self.forces_n)
        grid = (self.speeds_mm_s.size, self.forces_n.size)
        wanted = grid + np.shape(self.gains)[2:3]
        for name in _ARRAYS[2:]:
            shape = grid if name in ("noise_gains", "interpolated") else wanted
            if getattr(self, name).shape != shape or len(wanted) != 3:
                raise InputError(
                    f"expected {name} of shape {shape}, got {getattr(self, name).shape}; "
                    "the arrays of a model share one grid and one number of layers."
                )

    def _check_kinds(self) -> None:
        # A file may hold anything: "false" in quotes would count as true.
        check_texture_name(self.texture)
        texts = isinstance(self.estimator, str) and isinstance(self.simplified_from, str)
        kinds = isinstance(self.simulated, bool) and texts
        if not (is_number(self.rate_hz) and kinds):
            raise InputError(
                f"{self.texture}: expected a number for rate_hz, true or false for simulated and "
                f"text for estimator and simplified_from, got {shown(self.rate_hz)}, "
                f"{shown(self.simulated)}, {shown(self.estimator)} and "
                f"{shown(self.simplified_from)}; fit the model again."
            )

    def _check_values(self) -> None:
        check_rate(self.rate_hz)
        if self.unit not in UNITS:
            raise InputError(
                f"expected a unit among {', '.join(UNITS)}, got {shown(self.unit)}; fix."
            )
        for name in ("noise_gains", "gains", "level_sd_db"):
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f"expected finite {name}, got NaN or inf; fit the model again.")
        if (self.noise_gains < 0).any() or (self.level_sd_db < 0).any():
            raise InputError(
                "expected noise gains and level deviations of at least 0, got a negative one; "
                "fit the model again."
            )
        check_bands(self.frequencies_hz, self.bandwidths_hz, self.rate_hz)
        if self.blending not in BLENDINGS:
            raise InputError(
                f"expected a blending among {', '.join(BLENDINGS)}, got {shown(self.blending)}; "
                "fix it."
            )
        crossing = (self.gains > 0).any(axis=(0, 1)) & (self.gains < 0).any(axis=(0, 1))
        if self.blending == "logarithmic" and crossing.any():
            raise InputError(
                "expected one sign per layer where gains are blended in logarithms, got both in "
                f"layer {int(np.argmax(crossing)) + 1}; blend linearly, or turn it."
            )

    @property
    def n_layers(self) -> int:
        """Number of layers, m."""
        return int(self.gains.shape[2])

    @property
    def n_parameters(self) -> int:
        """Numbers per condition: 1 + 3m."""
        return 1 + 3 * self.n_layers

    @property
    def not_identifiable(self) -> Bools:
        """Where the records do not determine a layer's level, (S, F, m): deviations above 6 dB."""
        unknown: Bools = self.level_sd_db > LARGEST_IDENTIFIABLE_SD_DB
        return unknown

    def parameters(self, speed_mm_s: ArrayLike, force_n: ArrayLike) -> Parameters:
        """Interpolation over the grid as `blending` says; docs/method/rendering.md#grid-edges.

        Above the grid: clamped. Below the lowest speed or force all gains fall linearly to 0 at
        rest or lift-off (in the corner by the product of both ramps). NaN and infinite values
        count as lift-off.

        Parameters
        ----------
        speed_mm_s : (n,) array_like
            Tangential speed; its sign (direction) does not matter.
        force_n : (n,) array_like
            Normal force; negative values count as lift-off.
        """
        return self.table.at(speed_mm_s, force_n)

    @cached_property
    def table(self) -> ParameterTable:
        """The parameters as the renderer reads them."""
        speeds, forces = self.speeds_mm_s, self.forces_n
        values = np.concatenate(
            [self.noise_gains[..., None], self.frequencies_hz, self.bandwidths_hz, self.gains],
            axis=-1,
        )
        if self.blending == "logarithmic":
            speeds, forces, values = logarithmic_nodes(speeds, forces, values)
        speeds, values = wide_enough(speeds, values, along=0)
        forces, values = wide_enough(forces, values, along=1)
        return ParameterTable(
            speeds_mm_s=speeds, forces_n=forces, values=values, signs=np.zeros(self.n_layers)
        )

    def peq(self, speed_mm_s: float, force_n: float) -> PEQ:
        """The PEQ at one speed (mm/s) and force (N), interpolated as in `parameters`.

        Interpolation between legal values may leave the legal range by rounding; it is clamped.
        """
        return first_peq(self.parameters(speed_mm_s, force_n), rate_hz=self.rate_hz)

    def at_rate(self, rate_hz: float) -> TextureModel:
        """The same output spectrum written for noise of unit variance at another rate.

        The density of unit-variance noise falls as 1/rate, so gains grow as √(rate/old rate).
        The noise floor then reaches to the new Nyquist frequency.
        """
        check_rate(rate_hz)
        scale = np.sqrt(rate_hz / self.rate_hz)
        return replace(
            self,
            rate_hz=float(rate_hz),
            noise_gains=self.noise_gains * scale,
            gains=self.gains * scale,
        )

    def with_layers(self, keep: list[int]) -> TextureModel:
        """The model with only the layers of these indices (0-based), in that order."""
        arrays = {name: getattr(self, name)[:, :, keep] for name in _LAYER_ARRAYS}
        return replace(self, **arrays, fit=self.fit if keep == [*range(self.n_layers)] else None)


_LAYER_ARRAYS = (
    "frequencies_hz",
    "bandwidths_hz",
    "gains",
    "level_sd_db",
    "inherited",
    "unresolved",
)
_ARRAYS = ("speeds_mm_s", "forces_n", "noise_gains", "interpolated", *_LAYER_ARRAYS)
_BOOLEAN_ARRAYS = ("inherited", "unresolved", "interpolated")


def first_peq(at: Parameters, *, rate_hz: float) -> PEQ:
    """The PEQ at the first of the points, frequencies and widths moved into the legal range."""
    frequency, bandwidth, _ = clamp_bands(
        at.frequencies_hz[0], at.bandwidths_hz[0], rate_hz=rate_hz
    )
    return PEQ(
        noise_gain=float(at.noise_gain[0]),
        frequencies_hz=frequency,
        bandwidths_hz=bandwidth,
        gains=at.gains[0],
        rate_hz=rate_hz,
    )
