"""Sections declared once: what is held, refused, in which words, and what follows for readers."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.described import BESIDE, DescribedFile, FileSection, key, keys_of
from tactileq.modeling.files.describing import key_tables, schema
from tactileq.modeling.files.kinds import Name, TextureNames
from tactileq.modeling.files.values import NameOrFile
from tests.refusals import refused


@dataclass(frozen=True, kw_only=True)
class Part(FileSection):
    """A part."""

    WHERE: ClassVar[str] = "[[part]]"
    mass_g: Annotated[float, key("mass", unit="g", gt=0, le=100)]


@dataclass(frozen=True, kw_only=True)
class Machine(DescribedFile):
    """A machine."""

    WHAT: ClassVar[str] = "a machine"
    WHERE: ClassVar[str] = "[machine]"
    VERSION: ClassVar[int] = 3
    name: Annotated[Name, key("what it is called")]
    speed_hz: Annotated[float, key("turns", unit="Hz", ge=0, le=20)] = 2.0
    teeth: Annotated[int, key("of its wheel", ge=1)] | None = None
    band_hz: Annotated[tuple[float, float], key("range", unit="Hz")] | None = None
    mode: Annotated[Literal["slow", "fast"], key("how")] = "slow"
    on: Annotated[bool, key("whether it runs")] = False
    built: Annotated[datetime.date, key("when")] | None = None
    table: Annotated[NameOrFile, key("shipped, or a file")] | None = None
    place: Annotated[Path, key("where")] | None = None
    colours: Annotated[dict[str, Name], key("by part")] = field(default_factory=dict)
    textures: Annotated[TextureNames, key("on it")] = ()
    weight_g: Annotated[float, key("as given", ge=0, as_given=True)] = 1
    part: Annotated[tuple[Part, ...], key("its parts")] = ()


WHOLE = {"version": 3, "machine": {"name": "mill"}}


def machine(**keys: object) -> Machine:
    return Machine.read({"name": "mill", **keys})


def test_values_become_what_the_fields_hold(tmp_path: Path) -> None:
    made = Machine.read(
        {"name": "mill", "speed_hz": 3, "band_hz": [1, 2], "place": "a/b", "table": "own.tsv",
         "colours": {"wheel": "red"}, "part": [{"mass_g": 5}]},
        folder=tmp_path,
    )  # fmt: skip
    assert (made.speed_hz, type(made.speed_hz)) == (3.0, float)
    assert made.band_hz == (1.0, 2.0)
    assert made.place == tmp_path / "a/b"
    assert made.table is not None
    assert made.table.file == tmp_path / "own.tsv"
    assert made.part == (Part(mass_g=5.0),)
    assert machine(table="codec").table == "codec"
    assert replace(made, speed_hz=4).speed_hz == 4.0


def test_numbers_of_numpy_are_numbers() -> None:
    made = Machine(name="mill", speed_hz=np.float32(3), band_hz=np.array([1, 2]), teeth=np.int64(5))
    assert (made.speed_hz, made.band_hz, made.teeth) == (3.0, (1.0, 2.0), 5)


def test_a_whole_number_stays_one_where_it_is_said() -> None:
    assert [type(machine(weight_g=value).weight_g) for value in (5, 5.0)] == [int, float]


@pytest.mark.parametrize(
    ("keys", "meant"),
    [
        ({"sped_hz": 1}, ["speed_hz"]),
        ({"Speed_Hz": 1}, ["speed_hz"]),
        ({"speed-hz": 1, "tooth": 3, "texture": ["a"]}, ["speed_hz", "textures"]),
        ({"speed": 1}, ["speed_hz"]),
        ({"velocity": 1}, []),
        ({"x": 1}, []),
    ],
)
def test_a_misspelt_key_is_told_which_may_be_meant(
    keys: dict[str, object], meant: list[str]
) -> None:
    with refused(InputError, names="[machine]", got=list(keys)) as caught:
        machine(**keys)
    said = str(caught.value).partition("got")[2]
    assert [name for name in ("speed_hz", "teeth", "textures", "mode") if name in said] == meant
    assert ("mean" in said) == bool(meant)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("speed_hz", 21, ["number", "0", "20 Hz"]),
        ("speed_hz", float("nan"), ["number", "0", "20 Hz"]),
        ("speed_hz", True, ["number", "0", "20 Hz"]),
        ("speed_hz", 10**400, ["number", "0", "20 Hz"]),
        ("weight_g", float("inf"), ["number", "at least 0"]),
        ("teeth", 0, ["whole number", "at least 1"]),
        ("teeth", 2.5, ["whole number", "at least 1"]),
        ("band_hz", [1], ["number", "Hz"]),
        ("band_hz", [1, float("nan")], ["number", "Hz"]),
        ("mode", "quick", ['"slow"', '"fast"']),
        ("on", 1, ["true", "false"]),
        ("built", "2026-01-01", ["date", "without quotes"]),
        ("built", datetime.datetime(2026, 1, 1), ["date"]),
        ("table", 5, ["name", "path"]),
        ("name", "two\nlines", ["printable text in one line"]),
        ("colours", {"wheel": ""}, ["printable text in one line"]),
        ("textures", ["a", "a"], ["each once"]),
        ("textures", ["a" * 101], ["at most 100 characters"]),
    ],
)
def test_a_value_that_does_not_fit_is_refused_in_words(
    name: str, value: object, expected: list[str]
) -> None:
    with refused(InputError, names=["[machine]", name], expected=expected, got=shown(value)):
        machine(**{name: value})
    with refused(InputError, names=name, expected=expected):
        Machine(**{"name": "mill", name: value})


def test_sections_within_are_named_by_number() -> None:
    with refused(InputError, names=["[[part]]", "2", "mass_g"], expected="100 g", got="-1"):
        machine(part=[{"mass_g": 1}, {"mass_g": -1}])
    with refused(InputError, names="[[part]]", expected="table", got="5"):
        machine(part=5)


@pytest.mark.parametrize(
    ("values", "names"),
    [
        ({"version": 2, "machine": {"name": "a"}}, ["version", "2"]),
        ({"machine": {"name": "a"}}, ["version"]),
        ({"version": 3}, ["[machine]", "name"]),
        ({"version": 3, "machine": 5}, ["[machine]"]),
        ({**WHOLE, "colour": 1}, ["colour"]),
        ({"version": 3, "machine": {"name": "a", "part": [{"mass_g": 1}]}}, ["[machine]", "part"]),
    ],
)
def test_a_file_of_other_tables_is_refused(values: dict[str, object], names: list[str]) -> None:
    with refused(InputError, names=names):
        Machine.from_tables(values)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.dates(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@given(st.sampled_from([one.name for one in keys_of(Machine)]), JSON)
def test_any_value_is_held_or_refused_in_one_sentence(name: str, value: object) -> None:
    try:
        made = machine(**{name: value})
    except InputError as error:
        sentence = str(error)
        assert sentence.startswith("expected ")
        assert ", got " in sentence
        assert "\n" not in sentence
    else:  # and what is held is held again
        assert Machine.read(made.to_dict()) == made


def test_a_key_costs_one_line() -> None:
    """Reading, refusing, saving, the schema and the documentation follow from the declaration."""

    @dataclass(frozen=True, kw_only=True)
    class Longer(Machine):
        """A longer machine."""

        length_mm: Annotated[float, key("its length", unit="mm", ge=1, le=9)] = 5.0

    assert Longer.read({"name": "a", "length_mm": 2}).to_dict()["length_mm"] == 2.0
    with refused(InputError, names=["length_mm", "[machine]"], expected="9 mm", got="10"):
        Longer.read({"name": "a", "length_mm": 10})
    described = schema(Longer)["properties"]["machine"]["properties"]["length_mm"]
    assert (described["minimum"], described["maximum"], described["default"]) == (1, 9, 5.0)
    assert "| `length_mm` | a number from 1 to 9 mm | `5.0` | its length |" in key_tables(Longer)


@dataclass(frozen=True)
class Quantity(FileSection):
    """A number with its unit."""

    QUANTITY: ClassVar[str] = "value"
    value: Annotated[float, key("how much")]
    unit: Annotated[str, key("its unit")]

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}"


@dataclass(frozen=True, kw_only=True)
class Bench(DescribedFile):
    """A file with a quantity."""

    WHAT: ClassVar[str] = "a bench"
    WHERE: ClassVar[str] = "[bench]"
    VERSION: ClassVar[int] = 1
    mass: Annotated[Quantity, key("mass", unit="g", ge=0, le=9)]
    speed: Annotated[Quantity, key("speed", unit="m/s", gt=0)] | None = field(
        default=Quantity(5, "m/s")
    )
    path: Annotated[Path, BESIDE] = Path()


def test_a_quantity_has_unit_and_limits_of_the_key_that_holds_it() -> None:
    made = Bench.from_tables({"version": 1, "bench": {"mass": {"value": 3, "unit": "g"}}})
    assert made == Bench(mass=Quantity(3.0, "g"))
    assert Bench.read(made.to_dict()) == made
    heavy, long = Quantity(10, "g"), {"value": 1, "unit": "m"}
    for wrong, names, expected in (
        (heavy, ["value", "[bench.mass]"], "a number from 0 to 9 g"),
        (heavy.to_dict(), ["value", "[bench.mass]"], "a number from 0 to 9 g"),
        (long, ["unit", "[bench.mass]"], '"g"'),
        ({"value": 1}, ["unit", "[bench.mass]"], '"g"'),
        (3.0, ["mass", "[bench]"], "a quantity: a number from 0 to 9 g"),
    ):
        with refused(InputError, names=names, expected=expected):
            Bench.read({"mass": wrong})
    with refused(InputError, names=["value", "mass"], expected="9 g", got="10.0"):
        Bench(mass=heavy)


def test_a_quantity_is_one_row_of_the_table_and_narrow_in_the_schema() -> None:
    assert "| `mass` | a quantity: a number from 0 to 9 g | required | mass |" in key_tables(Bench)
    assert "| `5 m/s` | speed |" in key_tables(Bench)
    described = schema(Bench)["properties"]["bench"]["properties"]["mass"]["properties"]
    assert (described["value"]["maximum"], described["unit"]["enum"]) == (9, ["g"])


def test_what_stands_beside_is_no_key() -> None:
    assert [one.name for one in keys_of(Bench)] == ["mass", "speed"]
    made = Bench(mass=Quantity(3, "g"), path=Path("a.toml"))
    assert (made.path, set(made.to_dict())) == (Path("a.toml"), {"mass", "speed"})


def test_a_schema_holds_sections_and_what_is_required() -> None:
    described = schema(Machine)
    assert set(described["properties"]) == {"version", "machine", "part"}
    assert described["required"] == ["version", "machine"]
    assert described["properties"]["machine"]["required"] == ["name"]
    part = described["properties"]["part"]["items"]
    assert (part["required"], part["additionalProperties"]) == (["mass_g"], False)
