"""How tests change the bytes of a file at random: bits, lines, columns, values, encodings."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_]{3,}")
VALUES = (
    *(b"nan", b"NaN", b"inf", b"-Infinity", b"1e400", b"-1e308", b"1e-320", b"1e200", b"0", b"-1"),
    *(
        b"",
        b"loud",
        b'"loud"',
        b"null",
        b"true",
        b"[]",
        b"{}",
        b"[[1], 2]",
        b"1_0",
        b"0x1F",
        b"1,5",
    ),
    *(b"9" * 310, b"7" * 5000, b"9" * 30, b"[" * 100_000, b"[" * 70 + b"1" + b"]" * 70),
    *(b'"\\ud800"', b'"', b"'", b"\t", b"\0", "é".encode("cp1252"), "猫".encode(), b"x" * 100_000),
)
INSERTED = (
    b"\0",
    b'"',
    b"\t",
    b",",
    b"{",
    b"}",
    b"]",
    b"\n",
    b"\r",
    b"\xff",
    b"<a>",
    b"&a;",
    b"#",
    b"=",
)
Generator = np.random.Generator
Change = Callable[[bytes, Generator], bytes]


def place(data: bytes, rng: Generator) -> int:
    """Anywhere; half of the time near the beginning, where headers are."""
    end = len(data) if rng.random() < 0.5 else min(len(data), 64)
    return int(rng.integers(end + 1))


def flip(data: bytes, rng: Generator) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 9))):
        at = place(data, rng)
        if at < len(changed):
            changed[at] = int(rng.integers(256))
    return bytes(changed)


def truncate(data: bytes, rng: Generator) -> bytes:
    return data[: place(data, rng)]


def remove(data: bytes, rng: Generator) -> bytes:
    at = place(data, rng)
    return data[:at] + data[at + int(rng.integers(1, 200)) :]


def insert(data: bytes, rng: Generator) -> bytes:
    at = place(data, rng)
    return data[:at] + INSERTED[rng.integers(len(INSERTED))] + data[at:]


def lines(data: bytes, rng: Generator) -> bytes:
    """A line doubled, lost, or swapped with another."""
    rows = data.split(b"\n")
    first, second = (int(at) for at in rng.integers(len(rows), size=2))
    action = rng.integers(3)
    if action == 0:
        rows.insert(second, rows[first])
    elif action == 1:
        rows.pop(first)
    else:
        rows[first], rows[second] = rows[second], rows[first]
    return b"\n".join(rows)


def columns(data: bytes, rng: Generator) -> bytes:
    """Two columns of a table swapped, in all rows or in one."""
    rows = [re.split(rb"([\t,])", row) for row in data.split(b"\n")]
    widest = max(len(row) for row in rows) // 2 + 1
    first, second = (2 * int(at) for at in rng.integers(widest, size=2))
    chosen = set(range(len(rows))) if rng.random() < 0.5 else {int(rng.integers(len(rows)))}
    for number, row in enumerate(rows):
        if number in chosen and max(first, second) < len(row):
            row[first], row[second] = row[second], row[first]
    return b"\n".join(map(b"".join, rows))


def one_of(pattern: re.Pattern[bytes], data: bytes, rng: Generator, *, by: bytes) -> bytes:
    found = list(pattern.finditer(data))
    if not found:
        return data + by
    hit = found[int(rng.integers(len(found)))]
    return data[: hit.start()] + by + data[hit.end() :]


def value(data: bytes, rng: Generator) -> bytes:
    return one_of(NUMBER, data, rng, by=VALUES[rng.integers(len(VALUES))])


def word(data: bytes, rng: Generator) -> bytes:
    """A word, which may be a key, lost, changed, or replaced by another one of the file."""
    others = [*WORD.findall(data), b"", b"other", b"a\\tb", b"..", b"/dev/zero", b"y" * 9999]
    return one_of(WORD, data, rng, by=others[rng.integers(len(others))])


def encoding(data: bytes, rng: Generator) -> bytes:
    text = data.decode("utf-8", errors="replace")
    forms = (
        lambda: b"\xef\xbb\xbf" + data,
        lambda: data.replace(b"\n", b"\r\n"),
        lambda: data.replace(b"\n", b"\r"),
        lambda: text.encode("utf-16"),
        lambda: text.encode("utf-32-le"),
        lambda: data.replace(b"e", b"\xe9", 1),
        lambda: b"\0" * 100 + data,
    )
    return forms[rng.integers(len(forms))]()


CHANGES: tuple[Change, ...] = (
    *(flip, truncate, remove, insert, lines, columns, value, value, value, word, word, encoding),
)


def mutated(data: bytes, seed: int) -> bytes:
    """The data after one to three changes that follow from the seed."""
    rng = np.random.default_rng(seed)
    for _ in range(int(rng.integers(1, 4))):
        data = CHANGES[rng.integers(len(CHANGES))](data, rng)
    return data
