"""Thresholds against the numbers of docs/method/perception.md, and the codec's formula."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tactileq.modeling import InputError, Threshold
from tactileq.modeling.perception.thresholds import (
    LEVELS_G,
    SHIPPED,
    displacement_to_acceleration_g,
)
from tests.refusals import refused


def g_of(frequency_hz: float, displacement_um: float) -> float:
    """(2πf)²·x in g of 9.80665 m/s²."""
    return (2 * np.pi * frequency_hz) ** 2 * displacement_um * 1e-6 / 9.80665


def codec_um(frequency_hz: float) -> float:
    """T(f) = 62·[log10(f/550 + b)/log10 b]² − 77 dB, b = 1 − 250/550, 0.08 µm at 250 Hz."""
    b = 1 - 250 / 550
    rise_db = 62 * (np.log10(frequency_hz / 550 + b) / np.log10(b)) ** 2
    return 0.08 * 10 ** (rise_db / 20)


def table(*points: tuple[float, float]) -> Threshold:
    frequency, level = np.array(points, dtype=float).T
    return Threshold("own", frequency, level, "planted", "none")


def test_conversion_of_a_sinusoid() -> None:
    assert displacement_to_acceleration_g(250.0, 0.08) == pytest.approx(g_of(250, 0.08), rel=1e-12)
    # 1 mm at 1/(2π) Hz is 1 mm/s² = 0.10197 mg
    assert displacement_to_acceleration_g(1 / (2 * np.pi), 1000.0) == pytest.approx(1 / 9806.65)


@pytest.mark.parametrize("frequency", [10.0, 12.0, 31.0, 77.0, 150.0, 250.0, 333.3, 390.0, 400.0])
def test_shipped_codec_curve_follows_its_formula(frequency: float) -> None:
    assert Threshold.shipped("codec").at(frequency) == pytest.approx(
        g_of(frequency, codec_um(frequency)), rel=0.01
    )


def test_codec_curve_is_not_extrapolated() -> None:
    """The formula asks for 1.2 g at 500 Hz and 164 g at 700 Hz; used up to 400 Hz only."""
    assert g_of(500, codec_um(500)) == pytest.approx(1.2, abs=0.05)
    assert g_of(700, codec_um(700)) == pytest.approx(164, abs=1)
    codec = Threshold.shipped("codec")
    assert np.isnan(codec.at([500.0, 700.0, 400.1, 9.9])).all()


def test_shipped_pen_hold_points() -> None:
    pen = Threshold.shipped("pen-hold")
    assert pen.at(10.0) == pytest.approx(g_of(10, 26), rel=1e-6)
    for frequency in (160.0, 200.0, 250.0, 320.0):
        assert g_of(frequency, 0.06) <= pen.at(frequency) <= g_of(frequency, 0.1)
    assert np.isnan(pen.at([9.0, 321.0])).all()


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_tables_name_source_and_caveat(name: str) -> None:
    shipped = Threshold.shipped(name)  # type: ignore[arg-type]
    assert shipped.name == name
    assert len(shipped.source) > 30
    assert len(shipped.caveat) > 30
    assert "not stated in the file" not in (shipped.source, shipped.caveat)


@settings(deadline=None)
@given(st.floats(1, 100), st.floats(1.1, 10), st.floats(-6, 2), st.floats(-4, 4), st.floats(0, 1))
def test_interpolation_is_a_power_law_between_points(
    low: float, ratio: float, decade: float, slope: float, share: float
) -> None:
    level = 10**decade
    assume(LEVELS_G[0] <= level * ratio**slope <= LEVELS_G[1])
    curve = table((low, level), (low * ratio, level * ratio**slope))
    between = low * ratio ** (share * 0.999 + 0.0005)
    assert curve.at(between) == pytest.approx(level * (between / low) ** slope, rel=1e-9)


@settings(deadline=None)
@given(st.floats(1e-3, 1e5))
def test_above_the_range_the_last_level_is_held(frequency: float) -> None:
    curve = table((20.0, 0.1), (200.0, 0.2))
    held = curve.held(frequency)
    if frequency > 200.0:
        assert held == 0.2
    else:
        assert np.array_equal(held, curve.at(frequency), equal_nan=True)


def test_shipped_mobile_levels() -> None:
    """AOSP BasicToPwleSegmentAdapter, in dB re 1 g."""
    levels_mg = {10: 3.6, 20: 9.6, 40: 22.9, 50: 25.3, 100: 25.4, 150: 27.1, 200: 28.6}
    levels_mg |= {250: 35.6, 300: 45.7, 400: 102.0}
    mobile = Threshold.shipped("mobile")
    for frequency, level_mg in levels_mg.items():
        assert 1e3 * mobile.at(float(frequency)) == pytest.approx(level_mg, rel=0.01)
    assert mobile.held(1000.0) == pytest.approx(0.102, rel=1e-12)
    assert "not stated" in mobile.caveat


def test_outside_the_range_nothing_is_known() -> None:
    curve = table((20.0, 0.1), (200.0, 0.2))
    assert curve.at([20.0, 200.0]) == pytest.approx([0.1, 0.2])
    assert np.isnan(curve.at([0.0, -5.0, 19.99, 200.01, np.inf, np.nan])).all()
    assert curve.at(np.full((2, 3), 20.0)).shape == (2, 3)


@pytest.mark.parametrize(
    ("points", "got"),
    [
        ([(10.0, 1.0)], 1),
        ([(20.0, 1.0), (10.0, 1.0)], ["10 Hz", "20 Hz"]),
        ([(10.0, 1.0), (10.0, 2.0)], "10 Hz"),
        ([(0.0, 1.0), (10.0, 1.0)], "0 Hz"),
        ([(-5.0, 1.0), (10.0, 1.0)], "-5 Hz"),
        ([(10.0, 0.0), (20.0, 1.0)], ["level 0", "10 Hz"]),
        ([(10.0, 1.0), (20.0, -1.0)], ["level -1", "20 Hz"]),
        ([(10.0, np.nan), (20.0, 1.0)], ["nan", "10 Hz"]),
        ([(np.nan, 1.0), (20.0, 1.0)], "nan Hz"),
        ([(10.0, 1.0), (np.inf, 1.0)], "inf Hz"),
    ],
)
def test_values_that_are_no_thresholds_are_refused(
    points: list[tuple[float, float]], got: object
) -> None:
    with refused(InputError, expected=["frequencies", "levels", 0], got=got):
        table(*points)


def test_arrays_of_other_shapes_are_refused_and_lists_are_taken() -> None:
    with refused(InputError, expected="'own'", got=["(2,)", "(3,)"]):
        Threshold("own", [10, 20], [1, 2, 3], "", "")  # type: ignore[arg-type]
    own = Threshold("own", [10, 20], [1, 2], "", "")  # type: ignore[arg-type]
    assert own.at(20.0) == pytest.approx(2.0)
    assert own.valid_range_hz == (10.0, 20.0)
    assert not own.acceleration_g.flags.writeable


@pytest.mark.parametrize(
    ("column", "levels"), [("acceleration_g", (0.01, 0.5)), ("displacement_um", (26.0, 0.1))]
)
def test_own_table_in_both_columns(
    tmp_path: Path, column: str, levels: tuple[float, float]
) -> None:
    path = tmp_path / "lab.tsv"
    path.write_text(
        f"# source: our rig\n# caveat: one finger\nfrequency_hz\t{column}\n"
        f"10\t{levels[0]}\n250\t{levels[1]}\n"
    )
    own = Threshold.load(path)
    expected = levels if column == "acceleration_g" else (g_of(10, 26.0), g_of(250, 0.1))
    assert own.at([10.0, 250.0]) == pytest.approx(expected, rel=1e-9)
    assert (own.name, own.source, own.caveat) == ("lab", "our rig", "one finger")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("frequency_hz\tlevel\n10\t1\n20\t2\n", "acceleration_g or displacement_um"),
        ("frequency_hz\tacceleration_g\n", "expected"),
        ("frequency_hz\tacceleration_g\n10\t1\n", "two rising frequencies"),
        ("frequency_hz\tacceleration_g\n20\t1\n10\t1\n", "10 Hz after 20 Hz"),
        ("frequency_hz\tacceleration_g\n10\t1\n10\t2\n", "10 Hz after 10 Hz"),
        ("frequency_hz\tacceleration_g\tdisplacement_um\n10\t1\t1\n20\t2\t1\n", "got both"),
    ],
)
def test_damaged_tables_are_refused(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "lab.tsv"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        Threshold.load(path)


def test_comments_and_windows_line_ends_are_read(tmp_path: Path) -> None:
    path = tmp_path / "lab.tsv"
    path.write_bytes(
        b"# source: rig 2\r\nfrequency_hz\tacceleration_g\r\n10\t1\r\n# worn tip\r\n20\t2\r\n"
    )
    own = Threshold.load(path)
    assert own.at([10.0, 20.0]) == pytest.approx([1.0, 2.0])
    assert (own.source, own.caveat) == ("rig 2", "not stated in the file")


@pytest.mark.parametrize(
    ("name", "lowest", "highest"), [("codec", 10, 400), ("pen-hold", 10, 320), ("mobile", 10, 400)]
)
def test_shipped_tables_state_their_range(name: str, lowest: float, highest: float) -> None:
    assert Threshold.shipped(name).valid_range_hz == (lowest, highest)


def test_missing_tables_are_refused(tmp_path: Path) -> None:
    with refused(InputError, expected=tmp_path / "lab.tsv", got="nothing"):
        Threshold.load(tmp_path / "lab.tsv")
    with refused(InputError, expected=["codec", "pen-hold", "mobile", "TSV"], got="'ours'"):
        Threshold.shipped("ours")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("frequencies", "levels", "got"),
    [
        ([10.0, 600.0], [1e300, 1.0], ["1e+300", "10 Hz"]),
        ([10.0, 600.0], [1.0, 1e-300], ["1e-300", "600 Hz"]),
        ([1e-300, 600.0], [1.0, 1.0], "1e-300 Hz"),
        ([10.0, 1e300], [1.0, 1.0], "1e+300 Hz"),
    ],
)
def test_levels_and_frequencies_of_no_threshold(
    frequencies: list[float], levels: list[float], got: object
) -> None:
    with refused(InputError, expected=["1e-09 to 1e+06 g", "'lab'"], got=got):
        Threshold("lab", frequencies, levels, "test", "none")


def test_notes_of_a_table_that_a_spreadsheet_wrote(tmp_path: Path) -> None:
    lines = [
        '"# source: A, ""B"""',
        "# caveat: none",
        "frequency_hz;acceleration_g",
        "10;0,5",
        "20;1",
    ]
    for encoding in ("utf-8-sig", "utf-16"):
        (tmp_path / "lab.csv").write_bytes("\r\n".join(lines).encode(encoding))
        found = Threshold.load(tmp_path / "lab.csv")
        assert (found.source, found.caveat) == ('A, "B"', "none")
        assert found.acceleration_g.tolist() == [0.5, 1.0]
