"""What models of every kind share: versioned files that a person can open, and equality."""

from __future__ import annotations

from dataclasses import MISSING

import numpy as np

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import keys_of
from tactileq.modeling.files.described_json import DescribedJson


class SavedModel(DescribedJson):
    """A frozen dataclass of arrays, numbers and text that is saved as JSON and loads back equal."""

    WHAT = "a model file"
    ADVICE = "make the model again"

    def __post_init__(self) -> None:
        """Check every field by itself, and that arrays which name the same have as many of it.

        Optional arrays that are empty become zeros.
        """
        super().__post_init__()
        sizes: dict[str, int] = {}
        for one in (one for one in keys_of(type(self)) if one.shape):
            array = getattr(self, one.field)
            if not array.size and one.default is not MISSING:
                array = np.zeros([sizes.get(axis, 0) for axis in one.shape], dtype=array.dtype)
                array.setflags(write=False)
                object.__setattr__(self, one.field, array)
            for axis, size in zip(one.shape, array.shape, strict=False):
                sizes.setdefault(axis, int(axis) if axis.isdigit() else size)
            wanted = tuple(sizes.get(axis, "any") for axis in one.shape)
            if array.shape != wanted:
                raise InputError(
                    f"expected {one.field} of shape {wanted} ({' × '.join(one.shape)}), got "
                    f"{array.shape}; the arrays of a model share one grid, {self.ADVICE}."
                )

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            np.array_equal(getattr(self, one.field), getattr(other, one.field))
            for one in keys_of(type(self))
        )

    __hash__ = None  # type: ignore[assignment]
