"""The scene that a model was compiled for, as stored in the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from modeling.checks import check_name, is_number, is_positive
from modeling.errors import InputError, shown


@dataclass(frozen=True)
class CompiledFor:
    """The scene of a compiled model, and what is kept in it.

    Parameters
    ----------
    scene, scene_sha256 : str
        Its name, and the hash of its values.
    full_sha256 : str
        Of the model that this one was compiled from.
    bound : dict of str to float
        As in the scene: gfc30, bands_db, level_db.
    update_s : float
        From one parameter update to the next, > 0: what a renderer takes by default.
    single : bool
        Whether single precision keeps the bound, too.
    """

    scene: str
    scene_sha256: str
    full_sha256: str
    bound: Mapping[str, float] = field(hash=False)
    update_s: float
    single: bool

    def __post_init__(self) -> None:
        check_name("name of the scene of a compiled model", self.scene)
        texts = isinstance(self.scene_sha256, str) and isinstance(self.full_sha256, str)
        bound = isinstance(self.bound, Mapping) and all(map(is_number, self.bound.values()))
        if not (texts and bound and isinstance(self.single, bool) and is_positive(self.update_s)):
            raise InputError(
                "expected hashes, a bound of numbers, an update interval above 0 s and true or "
                f"false for single in compiled_for, got {shown(vars(self))}; compile the scene "
                "again."
            )

    @staticmethod
    def of(value: object) -> CompiledFor | None:
        """From the plain values of a model file; None stays None.

        Raises
        ------
        InputError
            For other fields than these, or values of other kinds.
        """
        if value is None or isinstance(value, CompiledFor):
            return value
        names = {f.name for f in fields(CompiledFor)}
        if not (isinstance(value, Mapping) and set(value) == names):
            raise InputError(
                f"expected {', '.join(sorted(names))} in compiled_for, got {shown(value)}; compile "
                "the scene again."
            )
        return CompiledFor(**value)
