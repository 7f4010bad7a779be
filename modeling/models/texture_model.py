"""The texture model: PEQ parameters over a grid of speeds and forces."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Bools, Floats, no_marks
from tactileq.modeling.checks import check_rate
from tactileq.modeling.equalizer.bands import check_bands, clamp_bands
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import key
from tactileq.modeling.files.kinds import Rate, Simulated, TextureName, Unit
from tactileq.modeling.files.saved_model import SavedModel
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.modeling.models.fit_summary import FitSummary
from tactileq.modeling.models.grid import Forces, Speeds
from tactileq.modeling.models.parameter_table import (
    Parameters,
    ParameterTable,
    logarithmic_nodes,
    wide_enough,
)
from tactileq.modeling.reprs import one_line

Blending = Literal["linear", "logarithmic"]
BLENDINGS: tuple[Blending, ...] = ("linear", "logarithmic")
_LAYERS = "speeds forces layers"
# Above this a layer's level is not identifiable (docs/method/fitting.md#not-identifiable).
LARGEST_IDENTIFIABLE_SD_DB = 6.0


@dataclass(frozen=True, eq=False, kw_only=True)
class TextureModel(SavedModel):
    """PEQ parameters of one texture over a rectangular grid of S speeds × F forces, m layers.

    Of one speed or force alone nothing is known of others. Optional arrays that are empty are
    unmarked.
    """

    FORMAT = "tactileq.texture-model"
    OPTIONAL = frozenset({"blending", "compiled_for", "fit", "simplified_from"})

    texture: Annotated[TextureName, key("name of the surface")]
    rate_hz: Annotated[Rate, key("at which the driving noise has unit variance")]
    speeds_mm_s: Speeds
    forces_n: Forces
    noise_gains: Annotated[
        Floats, key("G_w, in `unit` per unit noise", shape="speeds forces", ge=0)
    ]
    frequencies_hz: Annotated[Floats, key("peaks, as in `PEQ`", unit="Hz", shape=_LAYERS)]
    bandwidths_hz: Annotated[Floats, key("−3 dB widths, as in `PEQ`", unit="Hz", shape=_LAYERS)]
    gains: Annotated[Floats, key("G, signed, in `unit` per unit noise", shape=_LAYERS)]
    level_sd_db: Annotated[
        Floats,
        key(
            "standard deviation of each layer's level, from the estimator (0: known exactly)",
            unit="dB",
            shape=_LAYERS,
            ge=0,
        ),
    ]
    estimator: Annotated[
        str, key('what made the model ("paper", "paper-consistent", "planted", …)')
    ]
    unit: Unit = "g"
    simulated: Simulated = False
    inherited: Annotated[
        Bools, key("frequency taken over from the reference condition", shape=_LAYERS)
    ] = field(default_factory=no_marks)
    unresolved: Annotated[
        Bools, key("width or level not resolved (see `tactileq.Layers`)", shape=_LAYERS)
    ] = field(default_factory=no_marks)
    interpolated: Annotated[
        Bools,
        key("condition without a recording, filled from its neighbours", shape="speeds forces"),
    ] = field(default_factory=no_marks)
    blending: Annotated[
        Blending,
        key(
            "how parameters are read between conditions: linearly over speed and force, or as "
            "powers of both (docs/method/rendering.md#blending), for which no layer may change its "
            "sign"
        ),
    ] = "linear"
    compiled_for: Annotated[
        CompiledFor | None,
        key("the scene that the model was compiled for, with the bound that it keeps there"),
    ] = None
    simplified_from: Annotated[
        str, key("SHA-256 of the full model, where `simplify` dropped layers of it; else empty")
    ] = ""
    fit: Annotated[
        FitSummary | None,
        key(
            "what the estimator says of its fit; of a model with fewer layers or other nodes it "
            "says nothing"
        ),
    ] = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        super().__post_init__()
        check_bands(self.frequencies_hz, self.bandwidths_hz, self.rate_hz)
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
