"""What headers say: quantity, axis and unit in the spellings that people and loggers use."""

from __future__ import annotations

import pytest

from tactileq.rig.recording.importing.headers import (
    SPELLINGS,
    is_acceleration,
    known_unit,
    name_and_unit,
    overrange,
    role,
)


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("Acc z (ms-2)", ("acc_z", "m/s2")),
        ("Acc Z / m/s²", ("acc_z", "m/s2")),
        ("acc_z_ms2", ("acc_z", "m/s2")),
        ("x_m_s2", ("x", "m/s2")),
        ("Z[m/s2]", ("z", "m/s2")),
        ("Ａｃｃ　Ｚ（ｍ／ｓ²）", ("acc_z", "m/s2")),
        ("a/(m/s²)", ("a", "m/s2")),
        ("Acceleration (x) (m/s^2)", ("acceleration_x", "m/s2")),
        ("z (m/(s^2))", ("z", "m/s2")),
        ("z in g", ("z", "g")),
        ("X-Axis, G", ("x_axis", "g")),
        ("Z (g's)", ("z", "g")),
        ("z_mG", ("z", "mg")),
        ("CH1 [Volts]", ("ch1", "V")),
        ("gX", ("gx", "")),
        ("g", ("g", "g")),
        ("Acc X [Furlong]", ("acc_x", "furlong")),
        ("Kanal_1", ("kanal_1", "")),
        ("Time (sec)", ("time", "s")),
        ("t/s", ("t", "s")),
        ("Time [µs]", ("time", "us")),
        ("Time [μs]", ("time", "us")),
        ("time_ms", ("time", "ms")),
        ("Zeit in ms", ("zeit", "ms")),
        ("seconds_elapsed", ("time", "s")),
        ("elapsed_milliseconds", ("time", "ms")),
        ("Elapsed time (ms)", ("time", "ms")),
        ("micros", ("time", "us")),
        ("s", ("s", "")),
        ("", ("", "")),
    ],
)
def test_name_and_unit(header: str, expected: tuple[str, str]) -> None:
    assert name_and_unit(header) == expected


@pytest.mark.parametrize(
    "spelling",
    [
        *("m/s²", "m/s^2", "m/s2", "m/s/s", "m s-2", "ms-2", "m·s⁻²", "m s⁻²", "m s^-2", "m.s-2"),
        *("m/s**2", "m/sec^2", "M/S²", "meters per second squared", "Metre/Second^2", "m⋅s−2"),
    ],
)
def test_accelerations_per_second_squared(spelling: str) -> None:
    assert known_unit(spelling) == "m/s2"
    for header in (f"z ({spelling})", f"z [{spelling}]", f"z in {spelling}"):
        assert name_and_unit(header) == ("z", "m/s2")


def test_every_spelling_is_of_one_unit_and_is_read_as_it_stands() -> None:
    spellings = [spelling for of_one in SPELLINGS.values() for spelling in of_one]
    assert len(set(spellings)) == len(spellings)
    for unit, of_one in SPELLINGS.items():
        assert {known_unit(spelling) for spelling in of_one} == {unit} == {known_unit(unit)}


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        *(("x", "x"), ("aY", "y"), ("acc_z", "z"), ("accelX (g)", "x"), ("acc.x", "x")),
        *(("Linear Acceleration y (m/s^2)", "y"), ("X Acceleration", "x"), ("z-axis", "z")),
        *(("gX", None), ("gyro_x", None), ("accuracy", None), ("acc_accuracy", None)),
        *(("mag_z", None), ("timestamp", "time"), ("time_h", None), ("temperature", None)),
    ],
)
def test_roles(header: str, expected: str | None) -> None:
    assert role(header) == expected


def test_accelerations_are_told_from_other_channels() -> None:
    for header in ("aX", "Acceleration", "lin_acc_z", "ch1 (mg)", "y (m/s²)"):
        assert is_acceleration(header)
    for header in (
        "x",
        "gX",
        "accuracy",
        "gyro_x (rad/s)",
        "temperature (C)",
        "ch1 (V)",
        "mag_x (G)",
    ):
        assert not is_acceleration(header)


@pytest.mark.parametrize(
    "cell",
    [
        *(
            "OL",
            "O.L",
            "-OL",
            " 0L ",
            "OVLD",
            "over",
            "OFL",
            "Overload",
            "1.#INF",
            "-1.#INF",
            "inf",
        ),
        *("9.9E+37", "-9.90000000E+37", "9.91E37", "9,9E+37"),
    ],
)
def test_cells_beyond_the_range_of_an_instrument(cell: str) -> None:
    assert overrange(cell)


@pytest.mark.parametrize("cell", ["", "0", "9.8e36", "-1.5", "nan", "oak", "-", "1.#IND", "L"])
def test_other_cells(cell: str) -> None:
    assert not overrange(cell)
