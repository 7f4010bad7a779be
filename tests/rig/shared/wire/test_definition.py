"""A device's definition: what it refuses, and on what host and device have to agree."""

from __future__ import annotations

import copy
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.recorder.definition import RECORDER
from tactileq.rig.shared.wire.definition import Definition
from tests.refusals import refused

DOCS = Path(__file__).parents[4] / "docs"
FILE = Path(__file__).parents[4] / "rig/machines/device/device.yml"
VALUES = yaml.safe_load(FILE.read_text(encoding="utf-8"))


def loaded(folder: Path, values: Any) -> Definition:
    """What a file of these values gives."""
    path = folder / "device.yml"
    path.write_text(yaml.safe_dump(values), encoding="utf-8")
    return Definition.load(path)


def changed(*keys: str, to: Any) -> dict[str, Any]:
    """The values with another one at these keys."""
    values: dict[str, Any] = copy.deepcopy(VALUES)
    place = values
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = to
    return values


@pytest.mark.parametrize(
    ("values", "facts"),
    [
        (changed("schema", to=2), {"expected": 1, "got": 2}),
        (
            changed("registers", "State", "address", to=9),
            {"expected": "State", "got": [9, "Cause"]},
        ),
        (changed("registers", "State", "address", to=256), {"expected": "State", "got": 256}),
        (changed("registers", "State", "type", to="U12"), {"got": "U12"}),
        (changed("registers", "State", "colour", to=1), {"got": "colour"}),
        (changed("registers", "State", "length", to=0), {"expected": "State", "got": 0}),
        (changed("registers", "Samples", "length", to=100), {"expected": "Samples", "got": 100}),
        (changed("registers", "Source", "range", to=[0, 300]), {"expected": "Source", "got": "U8"}),
        (changed("registers", "Source", "range", to=[2, 0]), {"expected": "Source", "got": "U8"}),
        (changed("registers", "Wall", "range", to=[[0, 1], [0, 1]]), {"got": [2, 5]}),
        (changed("registers", "State", "maskType", to="Colour"), {"got": "Colour"}),
        (changed("firmwareVersion", to="one"), {"got": "one"}),
        (changed("registers", to=[]), {"got": "array"}),
        ("a text", {"got": "str"}),
    ],
)
def test_what_fits_no_device_is_refused(tmp_path: Path, values: Any, facts: dict[str, Any]) -> None:
    with refused(InputError, names="device.yml", **facts):
        loaded(tmp_path, values)


def test_no_yaml_and_unsafe_yaml_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "device.yml"
    for text in ("{", "!!python/object/apply:os.getcwd []", "- &a [*a]"):
        path.write_text(text, encoding="utf-8")
        with refused(InputError, names="device.yml"):
            Definition.load(path)


def test_what_both_must_agree_on_changes_the_hash(tmp_path: Path) -> None:
    same = loaded(tmp_path, changed("registers", "State", "description", to="another text"))
    assert same.schema_hash == DEVICE.schema_hash
    for values in (
        changed("registers", "State", "address", to=100),
        changed("registers", "ForceLimit", "range", to=[0.1, 21]),
        changed("registers", "ForceLimit", "unit", to="kN"),
        changed("groupMasks", "Command", "values", "ARM", to=7),
        changed("firmwareVersion", to="9.9"),
    ):
        assert loaded(tmp_path, values).schema_hash != DEVICE.schema_hash


def test_the_pages_give_the_identity_and_how_the_hash_is_made() -> None:
    said = json.loads((DOCS / "device/vectors.json").read_text(encoding="utf-8"))
    text = "".join(f"{line}\n" for line in said["schema"])
    assert hashlib.sha256(text.encode()).digest()[:8] == DEVICE.schema_hash.to_bytes(8, "big")
    for row in (
        "schema\t1",
        "device\ttactileq-cables\t29012\t1.2",
        "register\t0\tWhoAmI\tU16\t1\tr\talways\t\t0:65535",
        "register\t27\tTensionRange\tFloat\t2\trw\tidle\tN\t0:100\t0:100",
        "mask\tSource\tvalues\t0=NOTHING\t1=MODEL\t2=HOST",
    ):
        assert row in said["schema"]
    for page, of in (("device-registers.md", DEVICE), ("recorder-registers.md", RECORDER)):
        table = (DOCS / page).read_text(encoding="utf-8")
        values = dict(
            re.findall(r"^\| \d \| `(\w+)` \| U\d+ \| read \| (\w+) \|", table, re.MULTILINE)
        )
        assert int(values["WhoAmI"]) == of.who_am_i
        assert divmod(int(values["FirmwareVersion"]), 256) == of.firmware_version
        assert int(values["SchemaHash"], 16) == of.schema_hash


@given(st.data())
def test_what_a_register_takes_it_gives_back(data: st.DataObject) -> None:
    register = data.draw(st.sampled_from(sorted(DEVICE.registers.values(), key=lambda r: r.name)))
    value = tuple(
        data.draw(
            st.floats(low, high, width=32)
            if abs(low) < 1e30
            else st.floats(width=32, allow_nan=False, allow_infinity=False)
        )
        if register.type == "Float" and float(low).is_integer() and float(high).is_integer()
        else (low if register.type == "Float" else data.draw(st.integers(int(low), int(high))))
        for low, high in register.ranges
    )
    given_value = value[0] if register.length == 1 else value
    back = register.decoded(register.encoded(given_value))
    assert back == pytest.approx(given_value, rel=1e-7)
    assert len(register.encoded(given_value)) == register.size


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 20.1, -1.0, "3", None])
def test_a_value_out_of_its_range_is_refused(value: Any) -> None:
    with refused(InputError, expected=["ForceLimit", "0.1", "20", "N"]):
        DEVICE.registers["ForceLimit"].encoded(value)


def test_bytes_that_are_no_numbers_are_refused() -> None:
    with refused(InputError, names="Force", got="nan"):
        DEVICE.registers["Force"].decoded(b"\0\0\xc0\x7f")
    with refused(InputError, names="Force", expected=4, got=1):
        DEVICE.registers["Force"].decoded(b"\0")
    with pytest.raises(InputError):
        DEVICE.registers["Wall"].encoded((1.0, 2.0))
