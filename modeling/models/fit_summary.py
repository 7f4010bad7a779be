"""What the estimator says of its own fit, as stored in the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from tactileq.modeling.files.described import FileSection, key

_Distance = Annotated[float, key(unit="dB", ge=0, as_given=True)]


@dataclass(frozen=True)
class FitSummary(FileSection):
    """How near a fitted model should be to the truth, and what was found wrong.

    docs/method/fitting.md#expected-distance, docs/method/fitting.md#blends
    """

    WHERE = "fit"
    ADVICE = "fit the model again"

    distance_db: Annotated[
        _Distance, key("expected log-spectral distance from the true spectra at the recordings")
    ]
    blend_defect_db: Annotated[
        _Distance,
        key(
            "the largest distance of a response half-way between nodes from the mean of the "
            "logarithms at its nodes"
        ),
    ]
    with_blends_db: Annotated[
        _Distance, key("expected distance at the recordings and between them")
    ]
    by_layers_db: Annotated[
        Mapping[str, _Distance],
        key("the same with other numbers of layers that were tried", as_given=True),
    ] = field(hash=False)
    warnings: Annotated[
        tuple[str, ...],
        key("one sentence each: outliers, refused layers, scattered conditions"),
    ] = ()
