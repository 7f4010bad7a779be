"""Files that are declared once: what each key of a section may hold, its unit, range and default.

A section is a frozen dataclass that inherits from `FileSection`. Its fields are its keys: a type,
and by `key` what it means, its unit and its limits::

    @dataclass(frozen=True, kw_only=True)
    class HandRange(FileSection):
        WHERE = "[hand]"
        stroke_hz: Annotated[float, key("strokes back and forth", unit="Hz", ge=0, le=20)] = 2.0

From it follow reading, refusing, defaults, the JSON Schema and the tables of the documentation
(`tactileq.modeling.files.describing`). msgspec converts values and holds their limits. The
sentences are ours: its own ("Expected `int`, got `str`") say neither range nor unit nor what to do.

docs/where.md#a-key-of-a-file
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields
from functools import cache
from math import isfinite
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    Self,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec
import numpy as np
from msgspec import Meta, inspect

from tactileq.modeling.arrays import Bools
from tactileq.modeling.checks import check_keys
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.documents import check_version, read_toml
from tactileq.modeling.files.values import (
    NameOrFile,
    is_valid,
    item_of,
    within,
    without_numpy,
    words,
)


def key(
    description: str = "",
    *,
    unit: str = "",
    expected: str = "",
    advice: str = "",
    holds: Callable[[Any], bool] | None = None,
    reads: Callable[[Any], Any] | None = None,
    also: Any = None,
    as_given: bool = False,
    name: str = "",
    tables: Sequence[str] = (),
    shape: str = "",
    finite: bool = True,
    **limits: Any,
) -> Meta:
    """What is said of a key, or of a type that several keys have, for an annotation.

    Parameters
    ----------
    description : str
        Its meaning, for documentation and schema.
    expected : str
        What is expected, where type, limits and unit do not say it well.
    advice : str
        What to do about a wrong value: the end of the sentence.
    holds : callable, optional
        Whether a value of the type is good, where the limits cannot say it; in a class no lambda
        that uses names of the module, which its annotation does not see.
    reads : callable, optional
        Makes a value of the type from what a file may say instead, and leaves all else as it is.
    also : type, optional
        What that is, for the schema.
    as_given : bool
        Whether a whole number stays one where any number may be: 5 is not 5.0 in a text or a hash.
    name : str
        The key, where that is not the field's name.
    tables : sequence of str
        Of a mapping to sections: their names, by which they stand beside the other keys.
    shape : str
        Of an array, whose numbers the limits are about: what it has along each axis, such as
        "speeds forces".
    finite : bool
        Whether numbers have to be finite; others are text in a file: "nan", "inf", "-inf".
    limits
        Those of `msgspec.Meta`: ge, gt, le, lt, min_length, max_length, pattern.
    """
    said = {
        "unit": unit,
        "expected": expected,
        "advice": advice,
        "holds": holds,
        "reads": reads,
        "also": also,
        "as_given": as_given,
        "name": name,
        "tables": tuple(tables),
        "shape": tuple(shape.split()),
        "any_number": not finite,
    }
    extra = {what: value for what, value in said.items() if value}
    return Meta(description=description or None, extra=extra or None, **limits)


# How JSON files say numbers that it does not have.
NOT_FINITE = ("nan", "inf", "-inf")
# In an annotation: the field is no key but stands beside those of the file, such as its path.
BESIDE = "beside"


@dataclass(frozen=True, kw_only=True)
class Key:
    """One key of a section, as declared.

    `field` is its name in Python, `name` that in the file. `section` is the class of the section
    that it holds, None for a value; `several` says whether it holds a list of sections, `tables`
    the keys that each of a mapping of sections has of its own, and `keys` are those of the section
    as they are here. `always` says that it stands in every file even with a default; `shape` is
    empty but for arrays.
    """

    field: str
    name: str
    annotation: Any
    kind: inspect.Type
    default: Any
    section: type[FileSection] | None
    several: bool
    keys: tuple[Key, ...] = ()
    description: str = ""
    unit: str = ""
    expected: str = ""
    advice: str = "correct it"
    reads: Callable[[Any], Any] = lambda value: value
    also: Any = None
    as_given: bool = False
    tables: tuple[str, ...] = ()
    holds: Callable[[Any], bool] | None = None
    shape: tuple[str, ...] = ()
    any_number: bool = False
    always: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """What stands in a file: its name, or those of its tables."""
        return self.tables or (self.name,)

    def stated(self, values: Mapping[str, Any]) -> Any:
        """What a file states of it; KeyError where it states nothing."""
        if not self.tables:
            return values[self.name]
        return {name: values[name] for name in self.tables if name in values}

    @property
    def required(self) -> bool:
        """Whether it stands in every file."""
        return self.default is MISSING or self.always

    @property
    def words(self) -> str:
        """What is expected, in words."""
        if self.quantity is not None and self.section is not None:
            return f"a {self.section.__name__.lower()}: {self.quantity.words}"
        if self.shape:
            each = self.expected or f"each {words(item_of(self.kind), unit=self.unit)}"
            return f"an array of {' × '.join(self.shape)}, {each},"
        if self.expected or self.also is None:
            return self.expected or words(self.kind, unit=self.unit)
        return f"{words(inspect.type_info(self.also), unit=self.unit)}, or {words(self.kind)}"

    @property
    def quantity(self) -> Key | None:
        """The key of its section of which the unit and the limits of this one are."""
        name = "" if self.section is None else self.section.QUANTITY
        return next((one for one in self.keys if one.field == name), None)

    @property
    def is_table(self) -> bool:
        """Whether it holds sections, which are tables of their own, and no quantity."""
        return self.section is not None and self.quantity is None

    def within(self, where: str) -> str:
        """How messages call its section, which stands in a section that they call `where`."""
        own = "" if self.section is None else self.section.WHERE
        return own or (f"{where.removesuffix(']')}.{self.name}]" if where else self.name)

    def checked(self, value: Any, where: str, *, folder: Path | None = None) -> Any:
        """A value as the field holds it; InputError for any other, naming the key and `where`."""
        if self.quantity is not None:
            return self._with_quantity(value, where, folder)
        if self.section is not None:
            return self._sections(value, where, folder)
        if self.shape:
            return self._array(value, where)
        plain_value = without_numpy(self.reads(value))
        if self.any_number and plain_value in NOT_FINITE:
            plain_value = float(plain_value)
        try:
            converted = msgspec.convert(
                plain_value,
                self.annotation,
                builtin_types=_NATIVE,
                dec_hook=_path_in(folder),
            )
        except (msgspec.ValidationError, OverflowError):
            raise self.refusal(value, where) from None
        if not (self.any_number or is_valid(self.kind, converted)):
            raise self.refusal(value, where)
        return plain_value if self.as_given else converted

    def refusal(self, value: object, where: str, *, got: str = "") -> InputError:
        """The sentence about a value that the key does not hold, which it shows or calls `got`."""
        return InputError(
            f"expected {self.words} for {self.name}{where and f' under {where}'}, got "
            f"{got or shown(value)}; {self.advice}."
        )

    def _array(self, value: Any, where: str) -> np.ndarray[Any, Any]:
        """A read-only copy of numbers, or of true and false, that are within the limits."""
        kind = item_of(self.kind)
        dtype, kinds = (np.bool_, "b") if isinstance(kind, inspect.BoolType) else (float, "iuf")
        try:
            given = np.asarray(value)
        except ValueError:  # rows of several lengths
            raise self.refusal(value, where) from None
        if given.size and given.dtype.kind not in kinds:
            raise self.refusal(value, where)
        array: np.ndarray[Any, Any] = np.array(given, dtype=dtype)
        if not self.any_number and (wrong := array[~within(kind, array)]).size:
            raise self.refusal(wrong.flat[0], where)
        if array.size and array.ndim != len(self.shape):
            raise self.refusal(value, where, got=f"one of shape {array.shape}")
        if self.holds is not None and not self.holds(array):
            is_empty = not array.size and array.ndim > 1
            raise self.refusal(value, where, got=f"one of shape {array.shape}" * is_empty)
        array.setflags(write=False)
        return array

    def _with_quantity(self, value: Any, where: str, folder: Path | None) -> Any:
        assert self.section is not None  # or there is no quantity
        values = plain(value)
        if not isinstance(values, Mapping):
            raise self.refusal(value, where)
        return self.section(**_held(self.keys, values, self.within(where), folder=folder))

    def _sections(self, value: Any, where: str, folder: Path | None) -> Any:
        assert self.section is not None  # or there is no section to read
        if self.tables:
            check_keys(value, self.tables, where=self.name)
            return {
                name: _section(self.section, one, folder, where=f"[{name}]")
                for name, one in value.items()
            }
        if not self.several:
            return _section(self.section, value, folder, where=self.within(where))
        if not isinstance(value, list | tuple):
            raise no_table(self.section, value)
        if self.required and not (value or self.always):
            raise self.missing(self.section.WHERE)
        count = len(value)
        return tuple(
            _section(self.section, one, folder, where=_numbered(self.section.WHERE, place, count))
            for place, one in enumerate(value, start=1)
        )

    def missing(self, where: str, *, advice: str = "") -> InputError:
        """The sentence about a key that has to be there and is not."""
        if self.is_table:
            where = self.within(where)
            advice = advice or f"write {where} and its keys"
            return InputError(f"expected a table {where}, got none; {advice}.")
        return InputError(
            f"expected {self.name} ({self.words}) {f'under {where}' if where else 'at the top'}, "
            f"got none; {advice or 'add it'}."
        )


class FileSection:
    """The base of a section's dataclass: its fields are checked when it is made."""

    WHERE: ClassVar[str] = ""  # how messages call it: "[hand]", "[[model]]"
    # The field to which unit and limits of a key apply that holds such a section, in which then
    # `unit` is that unit.
    QUANTITY: ClassVar[str] = ""
    # What to do about a section that only programs write. All its keys stand in it, those with a
    # default, too, but for OPTIONAL, which are left out where they are None or an empty text.
    ADVICE: ClassVar[str] = ""
    OPTIONAL: ClassVar[frozenset[str]] = frozenset()

    def __post_init__(self) -> None:
        """Check and convert every field; sections with rules of their own extend this."""
        for one in keys_of(type(self)):
            value = getattr(self, one.field)
            if value is not one.default:
                # Not where: what `read` lets through is good, and options have no section.
                object.__setattr__(self, one.field, one.checked(value, ""))

    @classmethod
    def read(cls, values: object, *, where: str = "", folder: Path | None = None) -> Self:
        """A section from the plain values of its table.

        Parameters
        ----------
        values : mapping
        where : str
            How messages call the table, where that is not `WHERE`.
        folder : Path, optional
            What its paths are relative to.

        Raises
        ------
        InputError
            For what is no table, and for unknown, missing and wrong keys.
        """
        where = where or cls.WHERE
        if not isinstance(values, Mapping):
            raise no_table(cls, values, where=where)
        return cls(**_held(keys_of(cls), values, where, folder=folder, advice=cls.ADVICE))

    @classmethod
    def of_field(cls, field: str, value: object) -> Any:
        """A value as this field holds it, for a class that shares the field; InputError."""
        return next(one for one in keys_of(cls) if one.field == field).checked(value, cls.WHERE)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, those of a file."""
        values: dict[str, Any] = {}
        for one in keys_of(type(self)):
            value = plain(getattr(self, one.field))
            if value in (None, "") and one.name in self.OPTIONAL:
                continue
            values |= value if one.tables else {one.name: value}
        return values


class DescribedFile(FileSection):
    """The base of a whole TOML file: its values stand under `WHERE`, its sections in tables.

    Subclasses declare `WHAT` ("a scene"), and `VERSION` and `WHERE` unless the file states no
    version and has its values at the top.
    """

    WHAT: ClassVar[str]
    VERSION: ClassVar[int] = 0

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read such a file; its paths are relative to it.

        Raises
        ------
        InputError
            Naming the file, if it is missing, no TOML or of another version, and for unknown,
            missing and wrong keys.
        """
        file = Path(path)
        values = read_toml(file, cls.WHAT)
        with naming(file):
            return cls.from_tables(values, folder=file.parent)

    @classmethod
    def from_tables(cls, values: Mapping[str, Any], *, folder: Path | None = None) -> Self:
        """A file from its tables, `version` among them; refused as by `load`."""
        head, tables = cls.WHERE.strip("[]"), cls.tables()
        if not head and not cls.VERSION:
            return cls.read(values, folder=folder)
        check_keys(values, ("version", *filter(None, (head, *tables))), where=cls.WHAT)
        check_version(values, cls.VERSION, what=cls.WHAT.partition(" ")[2])
        plain = values.get(head, {})
        if not isinstance(plain, Mapping):
            raise no_table(cls, plain)
        check_keys(plain, [k.name for k in keys_of(cls) if not k.is_table], where=cls.WHERE)
        given = {name: values[name] for name in tables if name in values}
        return cls.read({**plain, **given}, folder=folder)

    @classmethod
    def tables(cls) -> tuple[str, ...]:
        """The names of its sections, without the one of its plain values."""
        return tuple(name for one in keys_of(cls) if one.is_table for name in one.names)


@contextmanager
def naming(file: Path) -> Iterator[None]:
    """Refusals within begin with the file's name."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def plain(value: Any) -> Any:
    """A value of a section as JSON and TOML hold it."""
    if isinstance(value, FileSection):
        return value.to_dict()
    if isinstance(value, tuple):
        return [plain(one) for one in value]
    if isinstance(value, Mapping):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, float) and not isfinite(value):
        return str(value)
    return value.tolist() if isinstance(value, np.ndarray) else value


def keys_of(section: type[FileSection]) -> tuple[Key, ...]:
    """The keys of a section, in the order of its fields."""
    return _keys_of(section)  # type: ignore[arg-type] # a class can be hashed


@cache
def _keys_of(section: Any) -> tuple[Key, ...]:
    return _keys(section, get_type_hints(section, include_extras=True))


def _keys_held(section: Any, holder: Any) -> tuple[Key, ...]:
    """The keys of a section with a quantity, of which its holder's annotation says more."""
    hints = get_type_hints(section, include_extras=True)
    hints[section.QUANTITY] = Annotated[hints[section.QUANTITY], *_metas(holder)]
    hints["unit"] = Annotated[Literal[_said(holder)["unit"]], *_metas(hints["unit"])]
    return _keys(section, hints)


def _keys(section: Any, hints: dict[str, Any]) -> tuple[Key, ...]:
    return tuple(
        _key(field.name, hints[field.name], default=_default(field), holder=section)
        for field in fields(section)
        if BESIDE not in getattr(hints[field.name], "__metadata__", ())
    )


def _held(
    keys: tuple[Key, ...],
    values: Mapping[str, Any],
    where: str,
    *,
    folder: Path | None,
    advice: str = "",
) -> dict[str, Any]:
    """The fields of a section from its table; refused as by `FileSection.read`."""
    check_keys(values, [name for one in keys for name in one.names], where=where or "the file")
    for one in keys:
        if one.required and one.name not in values:
            raise one.missing(where, advice=advice)
    given = [one for one in keys if any(name in values for name in one.names)]
    return {one.field: one.checked(one.stated(values), where, folder=folder) for one in given}


# What TOML holds as it is: a text is no date.
_NATIVE = (datetime.date, datetime.datetime)


def _key(name: str, annotation: Any, *, default: Any, holder: type[FileSection]) -> Key:
    always = bool(holder.ADVICE) and name not in holder.OPTIONAL
    advice = {"advice": holder.ADVICE} if holder.ADVICE else {}
    section, several = _section_of(annotation)
    said = _said(annotation)
    if "shape" in said:
        annotation = _rows(annotation, len(said["shape"]))
    keys = () if section is None else keys_of(section)
    if section is not None and section.QUANTITY:
        keys = _keys_held(section, annotation)
        said = {
            "description": said.get("description", ""),
            "advice": f"write {name} = {_example(keys)}",
        }
    return Key(
        **{"name": name, **advice, **said},
        always=always,
        field=name,
        annotation=annotation,
        kind=inspect.AnyType() if section else inspect.type_info(annotation),
        default=default,
        section=section,
        several=several,
        keys=keys,
    )


def _example(keys: tuple[Key, ...]) -> str:
    """A table in one line: { value = …, unit = "V" }."""
    pairs = [f"{one.name} = {one.words if one.name == 'unit' else '…'}" for one in keys]
    return f"{{ {', '.join(pairs)} }}"


def _rows(array: Any, axes: int) -> Any:
    """The type of an array's plain values."""
    limits = ("ge", "gt", "le")
    stated = {
        limit: value
        for meta in array.__metadata__
        for limit in limits
        if (value := getattr(meta, limit)) is not None
    }
    rows: Any = bool if array.__origin__ == Bools else Annotated[float, Meta(**stated)]
    for _ in range(axes):
        rows = tuple[rows, ...]
    return rows


def _default(field: Any) -> Any:
    return field.default if field.default_factory is MISSING else field.default_factory()


def _said(annotation: Any) -> dict[str, Any]:
    """All that `key` says of a type and, in a union with None, of its other member."""
    said: dict[str, Any] = {}
    for meta in _metas(annotation):
        said |= {
            **(meta.extra or {}),
            **({"description": meta.description} if meta.description else {}),
        }
    return said


def _metas(annotation: Any) -> Iterator[Meta]:
    if get_origin(annotation) in (Union, UnionType):
        for member in get_args(annotation):
            yield from _metas(member)
    yield from getattr(annotation, "__metadata__", ())


def _section_of(annotation: Any) -> tuple[type[FileSection] | None, bool]:
    """The class of the sections that a key holds, and whether it is a list of them."""
    if hasattr(annotation, "__metadata__"):
        annotation = annotation.__origin__
    if get_origin(annotation) in (Union, UnionType):
        return _section_of(next(one for one in get_args(annotation) if one is not NoneType))
    if get_origin(annotation) is Mapping:
        return _section_of(get_args(annotation)[1])
    if get_origin(annotation) is tuple:
        item, _ = _section_of(get_args(annotation)[0])
        return item, item is not None
    if isinstance(annotation, type) and issubclass(annotation, FileSection):
        return annotation, False
    return None, False


def _section(
    kind: type[FileSection], value: Any, folder: Path | None, *, where: str = ""
) -> FileSection:
    return value if isinstance(value, kind) else kind.read(value, where=where, folder=folder)


def _numbered(where: str, place: int, count: int) -> str:
    return f"{where} number {place}" if count > 1 else where


def _path_in(folder: Path | None) -> Callable[[type, Any], Any]:
    """Reads text as a path, relative to a folder."""

    def path(kind: type, value: Any) -> Any:
        if not isinstance(value, str | Path):
            raise msgspec.ValidationError
        if kind is NameOrFile:
            is_file = folder is not None and Path(value).suffix
            return NameOrFile(Path(folder or "", value).as_posix() if is_file else str(value))
        return Path(folder or "", value)

    return path


def no_table(section: type[FileSection], value: object, *, where: str = "") -> InputError:
    where = where or section.WHERE
    advice = section.ADVICE or f"write {where} above its keys"
    return InputError(f"expected a table {where}, got {shown(value)}; {advice}.")
