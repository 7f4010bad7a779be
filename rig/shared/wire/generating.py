"""What follows from a device's definition: C header, Python module, tables, byte vectors."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

from tactileq.rig.shared.wire.definition import Definition, Register, RegisterMask
from tactileq.rig.shared.wire.envelope import REPLY, Kind, WireFrame

_MADE = "Made from device.yml by `make docs-tables`; do not edit."
_LICENCE = "Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later"
_C_TYPES = {"Float": "float"} | {
    f"{letter}{bits}": f"{'u' * (letter == 'U')}int{bits}_t"
    for letter in "US"
    for bits in (8, 16, 32, 64)
}
_NONCE = 0x1234ABCD  # of the vectors
_BAR = r"\|"


def c_header(definition: Definition) -> str:
    """The registers as the firmware knows them: addresses, masks, one structure, one table."""
    registers = sorted(definition.registers.values(), key=lambda r: -r.size // r.length)
    by_address = sorted(definition.registers.values(), key=lambda r: r.address)
    major, minor = definition.firmware_version
    ranges = [
        (r.name, *one)
        for r in by_address
        if r.writes
        for one in (r.ranges if _differ(r) else r.ranges[:1])
    ]
    firsts = {name: n for n, (name, *_) in reversed(list(enumerate(ranges)))}
    lines = [
        f"/* Registers of {definition.name}. {_MADE}",
        "",
        f"   {_LICENCE} */",
        "",
        "#ifndef TQ_REGISTERS_H",
        "#define TQ_REGISTERS_H",
        "",
        "#include <stddef.h>",
        "#include <stdint.h>",
        "",
        f"#define TQD_WHO_AM_I_VALUE {definition.who_am_i}",
        f"#define TQD_FIRMWARE_VERSION_VALUE {256 * major + minor}",
        f"#define TQD_SCHEMA_HASH_VALUE UINT64_C({definition.schema_hash:#018x})",
        "",
        "/* Addresses. */",
        "enum {",
        *(f"    {_address(r)} = {r.address}," for r in by_address),
        "};",
        "",
        *(line for mask in definition.masks.values() for line in _c_mask(mask)),
        "/* What they hold. */",
        "typedef struct {",
        *(f"    {_C_TYPES[r.type]} {_member(r)};" for r in registers),
        "} tqd_values;",
        "",
        "enum { TQD_INTEGER, TQD_FLOAT };",
        "enum { TQD_READS = 1, TQD_WRITES = 2, TQD_IDLE_ONLY = 4 };",
        "",
        "typedef struct {",
        "    float low, high;",
        "} tqd_range;",
        "",
        "/* One register: bytes of an element, elements, its first range, whether each element has",
        "   its own, and where its value begins. */",
        "typedef struct {",
        "    uint8_t address, kind, bytes, length, access, ranges, each;",
        "    uint16_t offset;",
        "} tqd_register;",
        "",
        "/* Of those that can be written. */",
        "static const tqd_range tqd_ranges[] = {",
        *(f"    {{ {_real(low)}, {_real(high)} }}, /* {name} */" for name, low, high in ranges),
        "};",
        "",
        "static const tqd_register tqd_registers[] = {",
        *(f"    {_c_row(r, firsts)}" for r in by_address),
        "};",
        "",
        f"enum {{ TQD_REGISTERS = {len(by_address)} }};",
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def python_module(definition: Definition, prefix: str = "Device") -> str:
    """Its masks as enumerations, whose names begin with this."""
    lines = [
        f'"""What registers of {definition.name} hold.',
        "",
        _MADE,
        '"""',
        "",
        "from __future__ import annotations",
        "",
        "from enum import IntEnum" + ", IntFlag" * any(m.bits for m in definition.masks.values()),
    ]
    for mask in definition.masks.values():
        lines += ["", "", f"class {prefix}{mask.name}({'IntFlag' if mask.bits else 'IntEnum'}):"]
        lines += [f'    """{mask.description.split(";")[0].rstrip(".")}."""', ""]
        lines += [f"    {name} = {value}" for name, (value, _) in mask.members.items()]
    return "\n".join(lines) + "\n"


def register_table(definition: Definition) -> str:
    """Its registers in Markdown."""
    head = "| address | register | type | access | range, or value | unit | meaning |"
    major, minor = definition.firmware_version
    fixed = {
        "WhoAmI": str(definition.who_am_i),
        "FirmwareVersion": str(256 * major + minor),
        "SchemaHash": f"{definition.schema_hash:#018x}",
    }
    rows = [head, "|---|---|---|---|---|---|---|"]
    for r in sorted(definition.registers.values(), key=lambda r: r.address):
        access = "/".join(["read"] * r.reads + ["write"] * r.writes)
        access += " in IDLE" if r.when == "idle" else ""
        of = f" ([{r.mask}](#{r.mask.lower()}))" if r.mask else ""
        cells = (
            r.address,
            f"`{r.name}`",
            r.type if r.length == 1 else f"{r.type}[{r.length}]",
            access,
            fixed.get(r.name, _range_words(r)),
            r.unit,
            f"{r.description}{of}",
        )
        rows.append("| " + " | ".join(str(cell).replace("|", _BAR) for cell in cells) + " |")
    return "\n".join(rows)


def mask_tables(definition: Definition) -> str:
    """The names of values and bits in Markdown, a table each."""
    parts = []
    for mask in definition.masks.values():
        rows = [f"### {mask.name}", "", mask.description, "", "| value | name | meaning |"]
        rows.append("|---|---|---|")
        rows += [
            f"| {value} | `{name}` | {meaning} |" for name, (value, meaning) in mask.members.items()
        ]
        parts.append("\n".join(rows))
    return "\n\n".join(parts)


def vectors(definition: Definition) -> str:
    """Frames and the bytes that they are, for whoever writes another client or firmware (JSON)."""
    rows = [
        {
            "what": what,
            "kind": frame.kind,
            "sequence": frame.sequence,
            "nonce": frame.nonce,
            "body": frame.body.hex(),
            "bytes": frame.encoded().hex(),
        }
        for what, frame in _frames(definition)
    ]
    head = {
        "device": definition.name,
        "schemaHash": f"{definition.schema_hash:016x}",
        "schema": definition.schema_text.splitlines(),
    }
    return json.dumps(head | {"frames": rows}, indent=1, ensure_ascii=False) + "\n"


def _frames(definition: Definition) -> Iterator[tuple[str, WireFrame]]:
    yield "hello", WireFrame(Kind.HELLO, 0, 0)
    number = 0
    for r in sorted(definition.registers.values(), key=lambda r: r.address):
        number = 65535 if number == 1 else (number + 1) & 0xFFFF  # wraps early
        if r.reads:
            yield f"read {r.name}", WireFrame(Kind.READ, number, _NONCE, bytes([r.address]))
        for which in (0, 1) if r.writes else ():
            whole = r.type != "Float"
            value = tuple(int(one[which]) if whole else one[which] for one in r.ranges)
            data = r.encoded(value)
            body = bytes([r.address]) + data
            yield f"write {r.name}", WireFrame(Kind.WRITE, number, _NONCE, body)
            reply = WireFrame(Kind.WRITE | REPLY, number, _NONCE, b"\0" + body)
            yield f"reply to write {r.name}", reply
    yield "an upload", WireFrame(Kind.UPLOAD, 7, _NONCE, bytes(range(236)))
    yield "an event", WireFrame(Kind.EVENT | REPLY, 65535, _NONCE, bytes(236))


def _differ(register: Register) -> bool:
    return len(set(register.ranges)) > 1


def _address(register: Register) -> str:
    return f"TQD_{_snake(register.name).upper()}"


def _member(register: Register) -> str:
    length = f"[{register.length}]" if register.length > 1 else ""
    return _snake(register.name) + length


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def _c_mask(mask: RegisterMask) -> list[str]:
    return [
        f"/* {mask.description} */",
        "enum {",
        *(
            f"    TQD_{mask.name.upper()}_{name} = {value},"
            + (f" /* {meaning} */" if meaning else "")
            for name, (value, meaning) in mask.members.items()
        ),
        "};",
        "",
    ]


def _c_row(register: Register, firsts: dict[str, int]) -> str:
    access = ["TQD_READS"] * register.reads + ["TQD_WRITES"] * register.writes
    access += ["TQD_IDLE_ONLY"] * (register.when == "idle")
    kind = "TQD_FLOAT" if register.type == "Float" else "TQD_INTEGER"
    size = register.size // register.length
    first = firsts.get(register.name, 0)
    offset = f"offsetof(tqd_values, {_snake(register.name)})"
    return (
        f"{{ {_address(register)}, {kind}, {size}, {register.length}, {' | '.join(access)}, "
        f"{first}, {int(_differ(register))}, {offset} }},"
    )


def _real(value: float) -> str:
    text = repr(float(value))
    return f"{text}f"


def _range_words(register: Register) -> str:
    if not register.writes:
        return ""
    given = [f"{low:g}…{high:g}" for low, high in register.ranges]
    return given[0] if len(set(given)) == 1 else ", ".join(given)
