"""A device's registers as its `device.yml` defines them: read, checked, and the values they hold.

Names and types follow Harp's device schema; range, unit and `when` are added (docs/device.md).
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import msgspec

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.extras import extra
from tactileq.modeling.files.reading import read_text

with extra("rig"):
    import yaml

SCHEMA = 1
MOST_BODY = 236  # bytes of a frame's body
Kind = Literal["U8", "S8", "U16", "S16", "U32", "S32", "U64", "S64", "Float"]
Access = Literal["Read", "Write"]
Value = int | float | tuple[int, ...] | tuple[float, ...]
_CODES: dict[str, str] = {
    "U8": "B",
    "S8": "b",
    "U16": "H",
    "S16": "h",
    "U32": "I",
    "S32": "i",
    "U64": "Q",
    "S64": "q",
    "Float": "f",
}


class _Described(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    value: int
    description: str = ""


class _Mask(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    description: str
    values: dict[str, int | _Described] = {}
    bits: dict[str, int | _Described] = {}


class _Entry(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    address: int
    type: Kind
    access: Access | tuple[Access, ...]
    description: str
    length: int = 1
    range: tuple[float | tuple[float, float], ...] | None = None
    unit: str = ""
    maskType: str = ""
    when: Literal["idle", "always"] = "always"


class _File(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    schema: int
    device: str
    description: str
    whoAmI: int
    firmwareVersion: str
    numbers: Literal["little-endian"]
    groupMasks: dict[str, _Mask]
    bitMasks: dict[str, _Mask]
    registers: dict[str, _Entry]


@dataclass(frozen=True)
class RegisterMask:
    """Names of values, or of bits, with what each means.

    Parameters
    ----------
    members : mapping
        From name to value and meaning.
    """

    name: str
    description: str
    members: Mapping[str, tuple[int, str]]
    bits: bool


@dataclass(frozen=True)
class Register:
    """One register: what it holds, in which range, and who may read or write it.

    Parameters
    ----------
    ranges : tuple of (float, float)
        Of each element; that of the type where the file states none.
    when : {"idle", "always"}
        When it may be written.
    """

    name: str
    address: int
    type: Kind
    length: int
    reads: bool
    writes: bool
    ranges: tuple[tuple[float, float], ...]
    unit: str
    description: str
    mask: str
    when: str

    @property
    def size(self) -> int:
        """Bytes."""
        return struct.calcsize(self._format)

    def encoded(self, value: Value) -> bytes:
        """A value as bytes.

        Raises
        ------
        InputError
            For another number of elements, no number, or one out of range.
        """
        elements = value if isinstance(value, Sequence) else (value,)
        if len(elements) != self.length:
            raise InputError(
                f"expected {self.length} numbers for the register {self.name}, got "
                f"{len(elements)}; give one for each of: {self.description}."
            )
        for element, (low, high) in zip(elements, self.ranges, strict=True):
            if not self._fits(element, low, high):
                raise InputError(
                    f"expected {self.name} from {low:g} to {high:g}"
                    f"{f' {self.unit}' if self.unit and self.length == 1 else ''}, got "
                    f"{shown(element)}; give a number in that range."
                )
        return struct.pack(self._format, *elements)

    def decoded(self, data: bytes) -> Value:
        """The value that these bytes hold; numbers that are none are refused.

        Raises
        ------
        InputError
            For another number of bytes, or a Float that is not finite.
        """
        if len(data) != self.size:
            raise InputError(
                f"expected {self.size} bytes of the register {self.name}, got {len(data)}; "
                "the device's firmware is another one."
            )
        elements = struct.unpack(self._format, data)
        if not all(math.isfinite(element) for element in elements):
            raise InputError(
                f"expected finite numbers in the register {self.name}, got {elements}; start the "
                "device anew."
            )
        return elements[0] if self.length == 1 else elements

    def _fits(self, element: float, low: float, high: float) -> bool:
        if self.type == "Float":
            return isinstance(element, int | float) and low <= element <= high  # NaN is not
        return isinstance(element, int) and low <= element <= high

    @property
    def _format(self) -> str:
        return f"<{self.length}{_CODES[self.type]}"


@dataclass(frozen=True)
class Definition:
    """A device: what it is called, and its registers by name."""

    name: str
    description: str
    who_am_i: int
    firmware_version: tuple[int, int]
    masks: Mapping[str, RegisterMask]
    registers: Mapping[str, Register]

    @classmethod
    def load(cls, path: Path) -> Definition:
        """Read a `device.yml`.

        Raises
        ------
        InputError
            For no YAML, another schema, an unknown or missing key, an address twice, a range that
            the type does not hold, or a register too long for a frame.
        """
        text = read_text(path, "a device's definition")
        try:
            values = yaml.safe_load(text)
            file = msgspec.convert(values, _File, strict=True)
        except (yaml.YAMLError, msgspec.ValidationError, RecursionError) as error:
            reason = " ".join(str(error).split())
            raise InputError(
                f"expected a device's definition in {path}, got something else ({reason}); correct "
                "it (docs/device.md)."
            ) from None
        if file.schema != SCHEMA:
            raise InputError(
                f"expected schema {SCHEMA} of a device's definition in {path}, got {file.schema}; "
                "take the version of tactileq that it was written for."
            )
        return cls._from(file, path)

    @classmethod
    def _from(cls, file: _File, path: Path) -> Definition:
        masks = {
            name: _mask(name, mask, bits)
            for kind, bits in ((file.groupMasks, False), (file.bitMasks, True))
            for name, mask in kind.items()
        }
        registers = {name: _register(name, entry) for name, entry in file.registers.items()}
        _check(registers, masks, path)
        try:
            major, minor = (int(part) for part in file.firmwareVersion.split("."))
        except ValueError:
            raise InputError(
                f"expected a firmwareVersion such as 1.0 in {path}, got {file.firmwareVersion}; "
                "write two numbers."
            ) from None
        return cls(file.device, file.description, file.whoAmI, (major, minor), masks, registers)

    @cached_property
    def schema_text(self) -> str:
        """Everything on which both sides must agree, so not descriptions and order.

        docs/device.md#schema-hash
        """
        major, minor = self.firmware_version
        lines = [["schema", SCHEMA], ["device", self.name, self.who_am_i, f"{major}.{minor}"]]
        for r in sorted(self.registers.values(), key=lambda r: r.address):
            access = "r" * r.reads + "w" * r.writes
            ranges = (f"{low:.9g}:{high:.9g}" for low, high in r.ranges)
            row = ["register", r.address, r.name, r.type, r.length, access, r.when, r.unit]
            lines.append([*row, *ranges])
        for mask in sorted(self.masks.values(), key=lambda mask: mask.name):
            members = sorted((value, name) for name, (value, _) in mask.members.items())
            kind = "bits" if mask.bits else "values"
            lines.append(["mask", mask.name, kind, *(f"{value}={name}" for value, name in members)])
        return "".join("\t".join(map(str, line)) + "\n" for line in lines)

    @cached_property
    def sha256(self) -> str:
        """Of `schema_text`."""
        return hashlib.sha256(self.schema_text.encode()).hexdigest()

    @property
    def schema_hash(self) -> int:
        """The first 64 bits of `sha256`, as the register SchemaHash holds them."""
        return int(self.sha256[:16], 16)


def _mask(name: str, mask: _Mask, bits: bool) -> RegisterMask:
    given = mask.bits if bits else mask.values
    members = {
        member: (one, "") if isinstance(one, int) else (one.value, one.description)
        for member, one in given.items()
    }
    return RegisterMask(name, mask.description, members, bits)


def _register(name: str, entry: _Entry) -> Register:
    access = (entry.access,) if isinstance(entry.access, str) else entry.access
    given: Any = entry.range or _range_of(entry.type)
    ranges = given if isinstance(given[0], tuple) else (given,) * entry.length
    return Register(
        name=name,
        address=entry.address,
        type=entry.type,
        length=entry.length,
        reads="Read" in access,
        writes="Write" in access,
        ranges=ranges,
        unit=entry.unit,
        description=entry.description,
        mask=entry.maskType,
        when=entry.when,
    )


def _range_of(kind: Kind) -> tuple[float, float]:
    if kind == "Float":
        largest = 3.4028234663852886e38
        return -largest, largest
    bits = int(kind[1:])
    return (0, 2**bits - 1) if kind[0] == "U" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def _check(
    registers: Mapping[str, Register], masks: Mapping[str, RegisterMask], path: Path
) -> None:
    seen: dict[int, str] = {}
    for name, register in registers.items():
        problem = _problem(register, masks)
        if register.address in seen:
            problem = f"the address {register.address}, which {seen[register.address]} has"
        if problem:
            raise InputError(
                f"expected the register {name} in {path} to fit a device, got {problem}; correct "
                "it (docs/device.md)."
            )
        seen[register.address] = name


def _problem(register: Register, masks: Mapping[str, RegisterMask]) -> str:
    """What is wrong with it; empty for nothing."""
    low, high = _range_of(register.type)
    if not 0 <= register.address <= 255:
        return f"the address {register.address}, which is no byte"
    if not (register.length >= 1 and register.size <= MOST_BODY - 2):
        return f"a length of {register.length}, which is not from 1 to what a frame holds"
    if len(register.ranges) != register.length:
        return f"{len(register.ranges)} ranges for {register.length} elements"
    for one in register.ranges:
        if not (len(one) == 2 and low <= one[0] <= one[1] <= high):
            return f"the range {one}, which {register.type} does not hold"
    if register.mask and register.mask not in masks:
        return f"the maskType {register.mask}, which there is not"
    return ""
