"""A texture driven by regressions instead of a grid (PAPER IX-B).

docs/method/regression.md#driven-models
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import key
from tactileq.modeling.files.kinds import Rate, Simulated, TextureName, Unit
from tactileq.modeling.files.saved_model import SavedModel
from tactileq.modeling.models.compiled_for import CompiledFor
from tactileq.modeling.models.grid import Forces, Speeds
from tactileq.modeling.models.parameter_table import Parameters, ParameterTable
from tactileq.modeling.models.terms import CENTROID, DRIVING_TERMS, DrivenBy
from tactileq.modeling.models.texture_model import first_peq
from tactileq.modeling.reprs import one_line

_COEFFICIENTS = ("noise_gain", "frequencies_hz", "bandwidths_hz", "amplitudes", "centroid_hz")
_LAYERS = "coefficients layers"


@dataclass(frozen=True, eq=False, kw_only=True)
class RegressedModel(SavedModel):
    """Coefficients of every PEQ parameter of one texture with m layers, from `tactileq.regressed`.

    With driven_by="conditions" every parameter is β + α1·v + α2·F + α3·v·F (eq. 3), k = 4; with
    "centroid" it is p0 + p1·SC(v), k = 2, and SC(v) = c0 + c1·v. What a reduced model leaves out
    is 0.
    """

    FORMAT = "tactileq.regressed-model"
    OPTIONAL = frozenset({"compiled_for"})

    texture: Annotated[TextureName, key("name of the surface")]
    rate_hz: Annotated[Rate, key("at which the driving noise has unit variance")]
    driven_by: Annotated[DrivenBy, key("what predicts the parameters")]
    speeds_mm_s: Annotated[Speeds, key("the lowest and the highest of the grid", shape="2")]
    forces_n: Annotated[Forces, key("the lowest and the highest of the grid", shape="2")]
    noise_gain: Annotated[
        Floats, key("coefficients of G_w, in `unit` per unit noise", shape="coefficients")
    ]
    frequencies_hz: Annotated[Floats, key("coefficients of f", unit="Hz", shape=_LAYERS)]
    bandwidths_hz: Annotated[Floats, key("coefficients of B", unit="Hz", shape=_LAYERS)]
    amplitudes: Annotated[
        Floats, key("coefficients of |G|, in `unit` per unit noise", shape=_LAYERS)
    ]
    signs: Annotated[
        Floats,
        key(
            "of each layer over the whole texture",
            shape="layers",
            expected="each 1 or −1",
            holds=lambda signs: bool((abs(signs) == 1).all()),
        ),
    ]
    centroid_hz: Annotated[
        Floats,
        key("c0 (Hz) and c1 (Hz per mm/s); empty where the centroid drives nothing", shape="terms"),
    ]
    estimator: Annotated[str, key("of the `TextureModel` behind it")]
    unit: Unit = "g"
    simulated: Simulated = False
    compiled_for: Annotated[CompiledFor | None, key("as in `TextureModel`")] = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        super().__post_init__()
        wanted = {
            "noise_gain": 1 + len(DRIVING_TERMS[self.driven_by]),
            "centroid_hz": 2 if self.driven_by == CENTROID else 0,
        }
        for name, size in wanted.items():
            if getattr(self, name).size != size:
                raise InputError(
                    f"expected {name} of shape ({size},) where {self.driven_by} drive a model, got "
                    f"{getattr(self, name).shape}; make the model again."
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
