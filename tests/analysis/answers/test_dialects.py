"""Tables in every dialect from one truth: read as it is, or refused, never as another one."""

from __future__ import annotations

import csv
import io
import random
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactileq.analysis.answers.imported import load_imported
from tactileq.analysis.answers.table_map import parse_map
from tactileq.modeling import InputError

NAMES = (
    *("canvas", "MDF", "none", "None of these", "don't know", "oak, planed", 'say "ah"', "5 mm"),
    *("キャンバス", "Stoff é", "m²", "null hypothesis", "NaNa", "true", "7b", "1_1", "-"),
)
NUMBERS = ((1, 10, 100, 1000), (0.5, 1, 2.25), (1, 2, 3), (0.125, 0.25), (1000, 2000, 12000))
HEADERS = (
    *("model", "key_resp.corr", "How similar, from 0 to 100?", "Größe", "素材", "rt (ms)"),
    *('the "right" one', "rating", "count of it", "ＦＵＬＬ", "x=y"),
)
SEPARATORS = ("\t", ";", ",", "|", " ")
THOUSANDS = ("", "", "", ",", ".", "'", "\u00a0")
PREAMBLE = "Model: logger, v1.2\n\nStart;2026-01-01,12:00\n#note 5\n"
RAW = -1  # cells are joined as they are: what holds a separator or a quote is damaged
REMARKS = (
    "fine",
    "too rough, really",
    "",
    "3,5",
    '"too',
    'rough"',
    "a; b",
    '5" wide',
    "two\nlines",
)
BOOLS = (("0", "1"), ("false", "true"), ("FALSE", "TRUE"), ("False", "True"), ("wrong", "hit"))


# A refusal names the damaged place, both readings, or what is missing of the whole file.
PLACE_OR_READINGS = re.compile(
    r"line \d+|, which is .* or |lines that fit .* or |one number or two names|got none;|"
    r"\d lines?;|classes in|--right|blank cells?,"
)


@dataclass
class Truth:
    """Trials: participant, levels, and what was measured, None where nothing was answered."""

    measure: str
    trials: list[tuple[str, tuple[object, ...], object]]
    factors: int


@dataclass
class Dialect:
    """How the trials are written."""

    separator: str
    decimal: str
    thousands: str
    digits: int
    quoting: int
    missing: str
    bools: tuple[str, str]
    line_end: str
    encoding: str
    preamble: str
    extras: list[str]
    row_names: bool
    says_separator: bool
    repeats_header: bool
    ends: str
    trailing: str
    blanks: str

    @property
    def is_unambiguous(self) -> bool:
        """Whether docs/method/tables.md#dialects calls it so."""
        if self.quoting == RAW or self.trailing == "rows" or self.ends.startswith("\nTotal"):
            return False
        usual = self.thousands in ("", "'", "\u00a0") and (self.digits != 3)
        if self.quoting == csv.QUOTE_NONE and self.extras:
            return False
        not_blanks = self.separator != " " or self.quoting == csv.QUOTE_ALL
        is_text = self.encoding != "cp1252"
        return usual and not_blanks and is_text and not self.row_names


def drawn_truth(rng: random.Random) -> Truth:
    factors = rng.randint(0, 2)
    pools: list[Sequence[object]] = [
        rng.choice(NUMBERS) if rng.random() < 0.4 else rng.sample(NAMES, rng.randint(2, 3))
        for _ in range(factors)
    ]
    measure = rng.choice(("correct", "value", "answered"))
    classes = rng.sample(NAMES, 3) if rng.random() < 0.7 else list(map(str, rng.choice(NUMBERS)))
    if measure == "answered":
        pools.append(classes)  # the last level is the class that was presented
    people = [f"P{i}" if rng.random() < 0.5 else str(i) for i in range(1, rng.randint(2, 5))]
    size = rng.choice((1.0, 30.0, 1000.0, 30000.0))
    trials = []
    for who in people:
        for _ in range(rng.randint(1, 6)):
            levels = tuple(rng.choice(pool) for pool in pools)
            given: object = float(rng.randint(0, 1)) if measure == "correct" else rng.gauss(0, size)
            if measure == "answered":
                given = rng.choice([*classes, "don't know"])
            trials.append((who, levels, None if rng.random() < 0.1 else given))
    return Truth(measure, trials, factors)


def drawn_dialect(rng: random.Random) -> Dialect:
    decimal = rng.choice((".", ".", ","))
    return Dialect(
        separator=rng.choice(SEPARATORS),
        decimal=decimal,
        thousands=rng.choice([sign for sign in THOUSANDS if sign != decimal]),
        digits=rng.randint(0, 4),
        quoting=rng.choice((csv.QUOTE_MINIMAL, csv.QUOTE_ALL, csv.QUOTE_NONE, RAW)),
        missing=rng.choice(("", "", "NaN", "n/a", "NA", "null", "None", ".", "-nan(ind)")),
        bools=rng.choice(BOOLS),
        line_end=rng.choice(("\n", "\r\n", "\r")),
        encoding=rng.choice(("utf-8", "utf-8", "utf-8-sig", "utf-16", "cp1252")),
        preamble=rng.choice(("", "", "", "Exported by a program\n", PREAMBLE)),
        extras=rng.sample(("note", "n.a.", "date", "rt", "rt"), rng.randint(0, 3)),
        row_names=rng.random() < 0.1,
        says_separator=rng.random() < 0.1,
        repeats_header=rng.random() < 0.1,
        ends=rng.choice(("", "\n", "\n\n", "\nEND OF FILE\n", "\nTotal,12;3\n")),
        trailing=rng.choice(("", "", "", "rows", "all")),
        blanks=rng.choice(("", "", "", "", "after", "around")),
    )


def number(value: float, dialect: Dialect, digits: int) -> tuple[str, float]:
    """A number as the dialect writes it, and which one it then is."""
    text = f"{value:,.{digits}f}"
    exact = float(text.replace(",", ""))
    swap = {",": dialect.thousands, ".": dialect.decimal}
    return "".join(swap.get(sign, sign) for sign in text), exact


def written(truth: Truth, dialect: Dialect, names: Sequence[str], rng: random.Random) -> str | None:
    """The table, or None where the dialect cannot hold it; rounds the truth to what is written."""
    header = ["subject", *names, *dialect.extras]
    order = rng.sample(range(len(header)), len(header))
    rows = []
    for place, (who, levels, measured) in enumerate(truth.trials):
        cells = [who]
        for level in levels:
            if isinstance(level, str):
                cells.append(level)
            else:
                digits = len(f"{level}".partition(".")[2]) if isinstance(level, float) else 0
                cells.append(number(float(str(level)), dialect, digits)[0])
        if measured is None:
            cells.append(dialect.missing)
        elif truth.measure == "correct":
            cells.append(dialect.bools[int(measured == 1.0)])
        elif truth.measure == "answered":
            cells.append(str(measured))
        else:
            text, exact = number(float(str(measured)), dialect, dialect.digits)
            truth.trials[place] = (who, levels, exact)
            cells.append(text)
        # An unclosed quote and an unquoted line end, both, leave nothing that could be told.
        remarks = REMARKS if dialect.quoting != RAW else [r for r in REMARKS if "\n" not in r]
        cells += [rng.choice(remarks) for _ in dialect.extras]
        rows.append([cells[i] for i in order])
    lines = [[header[i] for i in order], *rows]
    if dialect.repeats_header and len(lines) > 3:
        lines.insert(3, lines[0])
    if dialect.row_names:
        lines[1:] = [[str(i), *cells] for i, cells in enumerate(lines[1:], 1)]
    if dialect.trailing:
        first = 1 if dialect.trailing == "rows" else 0
        lines[first:] = [[*cells, ""] for cells in lines[first:]]
    around = {"": "", "after": " ", "around": "  "}[dialect.blanks]
    if dialect.quoting == RAW:
        if dialect.separator == " ":
            return None  # in which no cell could be told from two, or from none
        joined = (dialect.separator + around).join
        table = "".join(f"{joined(cells)}\n" for cells in lines)
    else:
        try:
            table = quoted(lines, dialect)
        except csv.Error:
            return None  # a cell that has to be quoted
    if dialect.ends.startswith("\nTotal") and len(header) < 3:
        return None  # which would be a row
    said = f"sep={dialect.separator}\n" if dialect.says_separator else ""
    return said + dialect.preamble + table.removesuffix("\n") + dialect.ends


def quoted(lines: Sequence[Sequence[str]], dialect: Dialect) -> str:
    sheet = io.StringIO()
    none = dialect.quoting == csv.QUOTE_NONE
    writer = csv.writer(
        sheet,
        delimiter=dialect.separator,
        quoting=csv.QUOTE_NONE if none else csv.QUOTE_MINIMAL,
        quotechar=None if none else '"',
        lineterminator="\n",
    )
    if dialect.quoting == csv.QUOTE_ALL:
        writer = csv.writer(
            sheet, delimiter=dialect.separator, quoting=csv.QUOTE_ALL, lineterminator="\n"
        )
    writer.writerows(lines)
    return sheet.getvalue()


def expected(truth: Truth) -> list[tuple[object, ...]]:
    return [
        (who, *(str(level) for level in levels), measured)
        for who, levels, measured in truth.trials
        if measured is not None
    ]


def check_read_or_refused(folder: Path, seed: int) -> tuple[bool, bool]:
    """Whether a drawn table is unambiguous, and whether it was read as it was meant."""
    rng = random.Random(seed)
    truth, dialect = drawn_truth(rng), drawn_dialect(rng)
    presents = truth.measure == "answered"
    if presents and dialect.missing not in ("", "NaN", "n/a"):
        dialect.missing = ""  # the others may be names
    names = rng.sample(HEADERS, truth.factors + presents + 1)
    text = written(truth, dialect, names, rng)
    try:
        data = (text or "").replace("\n", dialect.line_end).encode(dialect.encoding)
    except UnicodeEncodeError:
        text = None
    if text is None or not expected(truth):
        return False, False
    path = folder / "table.csv"
    path.write_bytes(data)
    named = [f'"{name.replace(chr(34), chr(34) * 2)}"' for name in names]
    factors = [f"factor={name}" for name in named[: truth.factors]]
    roles = ["participant=subject", *factors]
    if presents:
        roles.append(f"presented={named[-2]}")
    right = dialect.bools[1] if dialect.bools[1] == "hit" and truth.measure == "correct" else ""
    try:
        mapping = parse_map([*roles, f"{truth.measure}={named[-1]}"], right=right)
        found = load_imported([path], mapping)
    except InputError as refusal:
        said = str(refusal)
        assert PLACE_OR_READINGS.search(said), said
        return dialect.is_unambiguous, False
    measures = ["presented", "answered"] if presents else [found.measure]
    columns = ["participant_id", *found.factors, *measures]
    got = [tuple(row) for row in found.answers[columns].itertuples(index=False)]
    assert got == expected(truth), (dialect, text)
    assert found.missed == sum(measured is None for *_, measured in truth.trials)
    return dialect.is_unambiguous, True


def check_many(folder: Path, examples: int) -> None:
    outcomes: Counter[tuple[bool, bool]] = Counter()

    @settings(
        max_examples=examples,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(seed=st.integers(0, 2**40))
    def every(seed: int) -> None:
        outcomes[check_read_or_refused(folder, seed)] += 1

    every()
    read, refused = outcomes[True, True], outcomes[True, False]
    assert read > 0.1 * examples
    assert read >= 0.9 * (read + refused)


def test_tables_in_every_dialect_are_read_or_refused(tmp_path: Path) -> None:
    check_many(tmp_path, 200)


@pytest.mark.long("ten thousand tables take minutes")
def test_ten_thousand_tables_are_read_or_refused(tmp_path: Path) -> None:
    check_many(tmp_path, 10_000)
