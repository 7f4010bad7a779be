"""What the estimator says of its own fit, as stored in the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from modeling.checks import is_number
from modeling.errors import InputError, shown


@dataclass(frozen=True)
class FitSummary:
    """How near a fitted model should be to the truth, and what was found wrong.

    Parameters
    ----------
    distance_db : float
        Expected log-spectral distance from the true spectra at the recordings, ≥ 0
        (docs/method/fitting.md#expected-distance).
    blend_defect_db : float
        The largest distance of a response half-way between nodes from the mean of the logarithms
        at its nodes, ≥ 0 (docs/method/fitting.md#blends).
    with_blends_db : float
        Expected distance at the recordings and between them, ≥ 0.
    by_layers_db : dict of str to float
        The same with other numbers of layers that were tried.
    warnings : tuple of str
        One sentence each: outliers, refused layers, scattered conditions.
    """

    distance_db: float
    blend_defect_db: float
    with_blends_db: float
    by_layers_db: Mapping[str, float] = field(hash=False)
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "warnings", tuple(self.warnings))
        numbers = [self.distance_db, self.blend_defect_db, self.with_blends_db]
        mapped = isinstance(self.by_layers_db, Mapping)
        numbers += self.by_layers_db.values() if mapped else []
        texts = all(isinstance(warning, str) for warning in self.warnings)
        if not (mapped and texts and all(is_number(n) and n >= 0 for n in numbers)):
            raise InputError(
                "expected distances of at least 0 dB and sentences in fit, got "
                f"{shown(vars(self))}; fit the model again."
            )

    @staticmethod
    def of(value: object) -> FitSummary | None:
        """From the plain values of a model file; None stays None.

        Raises
        ------
        InputError
            For other fields than these, or values of other kinds.
        """
        if value is None or isinstance(value, FitSummary):
            return value
        names = {f.name for f in fields(FitSummary)}
        if not (isinstance(value, Mapping) and set(value) == names):
            raise InputError(
                f"expected {', '.join(sorted(names))} in fit, got {shown(value)}; fit the model "
                "again."
            )
        return FitSummary(**value)
