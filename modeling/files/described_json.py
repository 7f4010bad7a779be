"""JSON files that programs write, declared once, as sections of `modeling/files/described.py`.

docs/where.md#a-key-of-a-file
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.described import FileSection, naming, no_table
from tactileq.modeling.files.documents import dump_json, read_json_object
from tactileq.modeling.files.hashes import sha256_of
from tactileq.modeling.files.writing import write_text


class DescribedJson(FileSection):
    """The base of a whole JSON file that programs write, with `format` and `version` at its top.

    Subclasses declare `WHAT` ("a model file"), `FORMAT`, `VERSION` where it is not 1, and `ADVICE`.
    """

    WHAT: ClassVar[str]
    FORMAT: ClassVar[str]
    VERSION: ClassVar[int] = 1

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read such a file.

        Raises
        ------
        InputError
            Naming the file, if it is missing, no JSON or of another format or version, and for
            unknown, missing and wrong keys.
        """
        file = Path(path)
        values = read_json_object(file, what=cls.WHAT, advice=cls.ADVICE)
        with naming(file):
            return cls.read(values)

    @classmethod
    def read(cls, values: object, *, where: str = "", folder: Path | None = None) -> Self:
        """A file from its plain values, as `to_dict` gives them; refused as by `load`."""
        if not isinstance(values, Mapping):
            raise no_table(cls, values, where=cls.WHAT)
        stated = (values.get("format"), values.get("version"))
        if stated != (cls.FORMAT, cls.VERSION):
            raise InputError(
                f"expected the format {cls.FORMAT} of version {cls.VERSION}, got "
                f"{shown(stated[0])} of version {shown(stated[1])}; give {cls.WHAT} of that "
                "format, or update tactileq if it is newer."
            )
        given = {name: v for name, v in values.items() if name not in ("format", "version")}
        return super().read(given, where=where, folder=folder)

    def to_dict(self) -> dict[str, Any]:
        """The plain values of the file."""
        return {"format": self.FORMAT, "version": self.VERSION, **super().to_dict()}

    def to_json(self) -> str:
        """The text of the file."""
        return dump_json(self.to_dict())

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file that `save` writes."""
        return sha256_of(self.to_json())

    def save(self, path: str | Path) -> None:
        """Write the file; it is there whole or not at all."""
        write_text(path, self.to_json())
