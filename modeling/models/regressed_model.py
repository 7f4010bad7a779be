"""A texture driven by regressions instead of a grid (PAPER IX-B).

docs/method/regression.md#driven-models
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from modeling.arrays import Floats
from modeling.checks import UNITS, check_rate, check_texture_name
from modeling.equalizer.peq import PEQ
from modeling.errors import InputError, shown
from modeling.files.saved_model import SavedModel
from modeling.models.compiled_for import CompiledFor
from modeling.models.grid import check_axes
from modeling.models.parameter_table import Parameters, ParameterTable
from modeling.models.terms import CENTROID, DRIVING_TERMS, DrivenBy, check_driver
from modeling.models.texture_model import first_peq

_COEFFICIENTS = ("noise_gain", "frequencies_hz", "bandwidths_hz", "amplitudes", "centroid_hz")
_ARRAYS = ("speeds_mm_s", "forces_n", "signs", *_COEFFICIENTS)


@dataclass(frozen=True, eq=False, kw_only=True)
class RegressedModel(SavedModel):
    """Coefficients of every PEQ parameter of one texture with m layers; see `modeling.regressed`.

    With driven_by="conditions" every parameter is β + α1·v + α2·F + α3·v·F (eq. 3), k = 4; with
    "centroid" it is p0 + p1·SC(v), k = 2, and SC(v) = c0 + c1·v. What a reduced model leaves out
    is 0.

    Parameters
    ----------
    texture : str
    rate_hz : float
        The rate at which the driving noise has unit variance.
    driven_by : {"conditions", "centroid"}
    speeds_mm_s, forces_n : (2,) array_like
        The lowest and the highest of the grid, > 0.
    noise_gain : (k,) array_like
        Coefficients of G_w, in `unit` per unit noise.
    frequencies_hz, bandwidths_hz, amplitudes : (k, m) array_like
        Coefficients of f and B (Hz) and of |G| (`unit` per unit noise).
    signs : (m,) array_like
        Each layer's sign over the whole texture, 1 or −1.
    centroid_hz : (2,) or (0,) array_like
        c0 (Hz) and c1 (Hz per mm/s); empty where the centroid drives nothing.
    estimator, unit, simulated
        As in the `TextureModel` behind it.
    compiled_for : CompiledFor, optional
        As in `TextureModel`.

    Raises
    ------
    InputError
        For wrong shapes or values out of range.
    """

    FORMAT = "tactileq.regressed-model"
    OPTIONAL = frozenset({"compiled_for"})

    texture: str
    rate_hz: float
    driven_by: DrivenBy
    speeds_mm_s: Floats
    forces_n: Floats
    noise_gain: Floats
    frequencies_hz: Floats
    bandwidths_hz: Floats
    amplitudes: Floats
    signs: Floats
    centroid_hz: Floats
    estimator: str
    unit: str = "g"
    simulated: bool = False
    compiled_for: CompiledFor | None = None

    def __post_init__(self) -> None:
        self._check_kinds()
        object.__setattr__(self, "compiled_for", CompiledFor.of(self.compiled_for))
        self._freeze(_ARRAYS)
        object.__setattr__(self, "rate_hz", float(self.rate_hz))
        check_axes(self.speeds_mm_s, self.forces_n)
        self._check_shapes()
        finite = all(np.isfinite(getattr(self, name)).all() for name in _COEFFICIENTS)
        if not finite or not np.isin(self.signs, (-1.0, 1.0)).all():
            raise InputError(
                "expected finite coefficients and signs of 1 or −1, got others; make the model "
                "again from its grid."
            )

    def _check_kinds(self) -> None:
        check_texture_name(self.texture)
        check_rate(self.rate_hz)
        kinds = isinstance(self.simulated, bool) and isinstance(self.estimator, str)
        if not (kinds and self.unit in UNITS):
            raise InputError(
                f"{self.texture}: expected a unit among {', '.join(UNITS)}, true or false for "
                f"simulated and text for estimator, got {shown(self.unit)}, "
                f"{shown(self.simulated)} and {shown(self.estimator)}; make the model again."
            )
        check_driver(self.driven_by)

    def _check_shapes(self) -> None:
        k, m = 1 + len(DRIVING_TERMS[self.driven_by]), self.signs.size
        wanted: dict[str, tuple[int, ...]] = {
            "speeds_mm_s": (2,),
            "forces_n": (2,),
            "noise_gain": (k,),
            "signs": (m,),
            **dict.fromkeys(("frequencies_hz", "bandwidths_hz", "amplitudes"), (k, m)),
            "centroid_hz": (2,) if self.driven_by == CENTROID else (0,),
        }
        for name, shape in wanted.items():
            if getattr(self, name).shape != shape:
                raise InputError(
                    f"expected {name} of shape {shape}, got {getattr(self, name).shape}; the "
                    "arrays of a model share one number of layers and of coefficients."
                )

    @property
    def n_layers(self) -> int:
        """Number of layers, m."""
        return int(self.signs.size)

    @property
    def n_parameters(self) -> int:
        """Numbers stored in all: the coefficients that are not 0 (of a grid: S·F·(1 + 3m))."""
        return sum(int(np.count_nonzero(getattr(self, name))) for name in _COEFFICIENTS)

    def parameters(self, speed_mm_s: ArrayLike, force_n: ArrayLike) -> Parameters:
        """The PEQ's parameters at n points; edges: docs/method/rendering.md#grid-edges.

        A noise gain or an amplitude that its regression would make negative is 0; a layer never
        changes its sign. Frequencies and widths may leave the legal range, as those of a
        `TextureModel` may by rounding; `peq` and `Renderer` clamp them.

        Parameters
        ----------
        speed_mm_s : (n,) array_like
            Tangential speed; its sign (direction) does not matter.
        force_n : (n,) array_like
            Normal force; negative values count as lift-off.
        """
        return self.table.at(speed_mm_s, force_n)

    @property
    def table(self) -> ParameterTable:
        """The regressions at the four corners of the grid.

        All their terms are linear in speed and in force, so that between the corners bilinear
        interpolation gives the regressions themselves, and the renderer needs to know no others.
        """
        speed, force = self.speeds_mm_s[:, None], self.forces_n[None, :]
        drive = (
            [self.centroid_hz[0] + self.centroid_hz[1] * speed + 0.0 * force]
            if self.driven_by == CENTROID
            else [speed + 0.0 * force, 0.0 * speed + force, speed * force]
        )

        def respond(coefficients: Floats) -> Floats:
            # Term by term, not as a matrix product, whose bits depend on the machine.
            constant, *slopes = coefficients
            response: Floats = np.broadcast_to(constant, (2, 2, *constant.shape))
            for x, slope in zip(drive, slopes, strict=True):
                response = response + x.reshape(2, 2, *(1,) * slope.ndim) * slope
            return response

        values = [
            respond(self.noise_gain)[..., None],
            respond(self.frequencies_hz),
            respond(self.bandwidths_hz),
            self.signs * respond(self.amplitudes),
        ]
        return ParameterTable(
            speeds_mm_s=self.speeds_mm_s,
            forces_n=self.forces_n,
            values=np.concatenate(values, axis=-1),
            signs=self.signs,
        )

    def peq(self, speed_mm_s: float, force_n: float) -> PEQ:
        """The PEQ at one speed (mm/s) and force (N), in the legal range."""
        return first_peq(self.parameters(speed_mm_s, force_n), rate_hz=self.rate_hz)
