"""What models of every kind share: versioned files that a person can open, and equality."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import asdict, fields, is_dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from modeling.errors import InputError, shortened, shown
from modeling.files.documents import dump_json, read_json_object
from modeling.files.hashes import sha256_of
from modeling.files.writing import write_text

if TYPE_CHECKING:
    from _typeshed import DataclassInstance as _Base
else:
    _Base = object


class SavedModel(_Base):
    """A frozen dataclass of arrays, numbers and text that is saved as JSON and loads back equal."""

    FORMAT: ClassVar[str]
    VERSION: ClassVar[int] = 1
    OPTIONAL: ClassVar[frozenset[str]] = frozenset()  # fields that a file may lack

    def save(self, path: str | Path) -> None:
        """Write the model as versioned JSON; the file is there whole or not at all."""
        write_text(path, self.to_json())

    def to_json(self) -> str:
        """The text of the model's file."""
        return dump_json(self.to_dict())

    def to_dict(self) -> dict[str, Any]:
        """The model as plain values, those of its file; `from_dict` makes it again.

        An optional field that is None or an empty text is left out.
        """
        values = {f.name: _plain(getattr(self, f.name)) for f in fields(self)}
        given = {n: v for n, v in values.items() if not (v in (None, "") and n in self.OPTIONAL)}
        return {"format": self.FORMAT, "version": self.VERSION, **given}

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file that `save` writes: equal exactly where models are equal."""
        return sha256_of(self.to_json())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a model written by `save`.

        Raises
        ------
        InputError
            If the file is missing, is no such model, or has another version.
        """
        return cls.from_dict(
            read_json_object(Path(path), what="a model file", advice="fit it again"),
            source=Path(path),
        )

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], *, source: Path) -> Self:
        """A model from the plain values of its file.

        Parameters
        ----------
        values : mapping
            As `to_dict` gives them.
        source : Path
            Where they stand, for what is said of them.

        Raises
        ------
        InputError
            If they are of no such model, or of another version.
        """
        given = _fields(values, cls.FORMAT, version=cls.VERSION, source=source)
        names = {f.name for f in fields(cls)}
        wrong = ", ".join(sorted((names - cls.OPTIONAL - set(given)) | (set(given) - names)))
        if wrong:
            raise InputError(
                f"expected the fields of a {cls.FORMAT} in {source}, got too few or too many "
                f"({shortened(wrong)}); make the file again."
            )
        try:
            return cls(**given)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
        except (TypeError, ValueError, OverflowError):
            raise InputError(
                f"{source}: expected numbers in rows of one length, got others; make the file "
                "again."
            ) from None

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    __hash__ = None  # type: ignore[assignment]

    def _freeze(self, names: Iterable[str], *, booleans: Container[str] = ()) -> None:
        """Make these fields read-only arrays, of floats or, where named so, of booleans."""
        for name in names:
            kind = np.bool_ if name in booleans else np.float64
            try:
                value: NDArray[Any] = np.array(getattr(self, name), dtype=kind)
            except (TypeError, ValueError, OverflowError):
                raise InputError(
                    f"expected numbers in {name}, in rows of one length, got "
                    f"{shown(getattr(self, name))}; make the model again."
                ) from None
            value.setflags(write=False)
            object.__setattr__(self, name, value)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value, dict_factory=_listed)
    return value


def _listed(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Values by name as JSON reads them back: tuples are lists."""
    return {name: list(v) if isinstance(v, tuple) else v for name, v in pairs}


def _fields(values: Any, file_format: str, *, version: int, source: Path) -> dict[str, Any]:
    """The fields of a model file of this format and version."""
    if not isinstance(values, Mapping) or values.get("format") != file_format:
        raise InputError(
            f"expected the format {file_format} in {source}, got another; give a model of "
            "that kind."
        )
    if values.get("version") != version:
        raise InputError(
            f"expected a model of version {version} in {source}, got version "
            f"{shown(values.get('version'))}; update tactileq or fit the model again."
        )
    return {name: value for name, value in values.items() if name not in ("format", "version")}
