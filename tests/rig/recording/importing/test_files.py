"""Files of other equipment: what is read, and what is refused with one sentence."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import wavfile
from scipy.signal import welch

from tactileq.modeling import InputError, RecordingSet
from tactileq.rig.recording.importing.csv_columns import parse_columns
from tactileq.rig.recording.importing.files import (
    import_csv,
    import_csv_file,
    import_wav,
    import_wav_file,
    usable,
)
from tactileq.rig.recording.importing.labels import Label, labels_from_table
from tests.refusals import check_refusal, refused, warned

LABEL = Label("oak", 100.0, 1.0)
CHANNEL_C = {"mv_per_g": 1.0, "named": {"z": "Channel C"}}
# Records in these tests are short; `test_recordings_too_short_for_models_are_told` is about that.
pytestmark = pytest.mark.filterwarnings("ignore:.*models need 0.2 s:UserWarning")

RATE_HZ = 3200.0


@pytest.fixture
def axes() -> NDArray[np.float64]:
    return np.random.default_rng(5).normal(0, 0.3, (3, 2000))


def test_a_header_that_was_never_closed_is_told_of(tmp_path: Path) -> None:
    wavfile.write(tmp_path / "a.wav", 8000, np.arange(4000, dtype=np.int16))
    whole = (tmp_path / "a.wav").read_bytes()
    (tmp_path / "a.wav").write_bytes(whole[:40] + bytes(4) + whole[44:])
    imported = import_wav_file(tmp_path / "a.wav", LABEL, g_per_fullscale=16)
    assert imported.recording.samples.size == 4000
    check_refusal(imported.warnings[0], names=["a.wav", "header", "0 samples", "4000 samples"])
    with warned(names=["a.wav", "4000 samples"]):
        import_wav([tmp_path / "a.wav"], [LABEL], g_per_fullscale=16)


def write_csv(
    path: Path, header: str, columns: NDArray[np.float64], *, delimiter: str = ","
) -> Path:
    rows = [delimiter.join(repr(float(value)) for value in row) for row in columns.T]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def with_time(axes: NDArray[np.float64], *, scale: float = 1.0) -> NDArray[np.float64]:
    return np.vstack([np.arange(axes.shape[1]) / RATE_HZ * scale, axes])


@pytest.mark.parametrize(("axis", "row"), [("x", 0), ("y", 1), ("z", 2)])
def test_one_axis_of_three_with_its_own_rate(
    tmp_path: Path, axes: NDArray[np.float64], axis: str, row: int
) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,x_g,y_g,z_g", with_time(axes))
    recording = import_csv([path], [LABEL], axis=axis).recordings[0]
    assert np.array_equal(recording.samples, axes[row])
    assert recording.rate_hz == pytest.approx(RATE_HZ, rel=1e-12)
    assert (recording.unit, recording.condition, recording.texture) == ("g", (100.0, 1.0), "oak")


def test_dft321_keeps_the_energy_of_all_axes(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    path = write_csv(tmp_path / "a.csv", "t,ax,ay,az", with_time(axes))
    samples = import_csv([path], [LABEL], axis="dft321", unit="g").recordings[0].samples
    # Parseval: equal magnitudes at every frequency mean equal energy.
    assert np.sum(samples**2) == pytest.approx(np.sum(axes**2), rel=1e-9)
    expected = np.sqrt((np.abs(np.fft.rfft(axes, axis=1)) ** 2).sum(axis=0))
    np.testing.assert_allclose(np.abs(np.fft.rfft(samples)), expected, rtol=1e-9, atol=1e-9)


def test_dft321_of_a_tilted_sine_does_not_double_its_frequency(tmp_path: Path) -> None:
    time = np.arange(3200) / RATE_HZ
    sine = np.sin(2 * np.pi * 100 * time)
    path = write_csv(tmp_path / "a.csv", "t,x,y,z", np.vstack([time, sine, 2 * sine, -0.5 * sine]))
    samples = import_csv([path], [LABEL], axis="dft321").recordings[0].samples
    spectrum = np.abs(np.fft.rfft(samples))
    assert np.fft.rfftfreq(samples.size, 1 / RATE_HZ)[np.argmax(spectrum)] == pytest.approx(100)
    assert spectrum[200] < 1e-9 * spectrum[100]


@pytest.mark.parametrize(
    ("header", "scale", "factor"),
    [
        ("Time (ms),Acc X [m/s²],Acc Y [m/s²],Acc Z [m/s²]", 1e3, 1 / 9.80665),
        ("time_us;x_mg;y_mg;z_mg", 1e6, 1e-3),
        ("timestamp\taccel_x_m_s2\taccel_y_m_s2\taccel_z_m_s2", 1.0, 1 / 9.80665),
    ],
)
def test_units_in_the_header(
    tmp_path: Path, axes: NDArray[np.float64], header: str, scale: float, factor: float
) -> None:
    delimiter = max(",;\t", key=header.count)
    path = write_csv(tmp_path / "a.csv", header, with_time(axes, scale=scale), delimiter=delimiter)
    recording = import_csv([path], [LABEL], axis="y").recordings[0]
    np.testing.assert_allclose(recording.samples, axes[1] * factor, rtol=1e-12)
    assert recording.rate_hz == pytest.approx(RATE_HZ, rel=1e-9)
    assert recording.unit == "g"


def test_coarse_time_stamps_give_the_mean_rate(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    time = np.floor(np.arange(2000) / RATE_HZ * 1000) / 1000  # whole milliseconds
    path = write_csv(tmp_path / "a.csv", "time_s,x", np.vstack([time, axes[0]]))
    rate_hz = import_csv([path], [LABEL]).recordings[0].rate_hz
    assert rate_hz == pytest.approx(RATE_HZ, rel=2e-3)


def test_without_a_unit_it_is_arbitrary(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,acceleration", with_time(axes[:1]))
    recording = import_csv([path], [LABEL]).recordings[0]
    assert recording.unit == "arbitrary"
    assert np.array_equal(recording.samples, axes[0])


@pytest.mark.parametrize(
    ("header", "options", "expected", "got"),
    [
        ("x,y,z", {"axis": "x"}, ["time", "--rate", "a.csv"], "x, y, z"),
        ("time,x,y,z", {}, ["--axis", "dft321", "a.csv"], "x, y, z"),
        ("time,x,y,q", {"axis": "dft321"}, ["x, y, z", "a.csv"], "x, y, q"),
        ("time,x,ax,z", {"axis": "x"}, ["x", "once", "a.csv"], "x, ax, z"),
        ("time,x,y,ay", {"axis": "dft321"}, ["x, y, z", "once", "a.csv"], "x, y, ay"),
        ("time,x,y,z", {"axis": "w"}, ["axis", "x, y, z, dft321"], "'w'"),
        ("time,x (furlong),y,z", {"axis": "x"}, ["unit", "m/s2", "a.csv"], "'furlong'"),
        ("time,x,y,z", {"axis": "x", "unit": "stone"}, ["m/s2", "--unit"], "'stone'"),
        ("time_h,x,y,z", {"axis": "x"}, ["time", "--rate", "a.csv"], "time_h"),
    ],
)
def test_refused_layouts(
    tmp_path: Path,
    axes: NDArray[np.float64],
    header: str,
    options: dict[str, str],
    expected: object,
    got: str,
) -> None:
    columns = axes if header.startswith("x") else with_time(axes)
    path = write_csv(tmp_path / "a.csv", header, columns)
    with refused(InputError, expected=expected, got=got) as caught:
        import_csv([path], [LABEL], **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected", "got"),
    [
        ("", "header", "empty"),
        ("time,x\n", "header", "1 line"),
        ("time,x\n0,1\n0.1,2\n0.2", ["2 values", "line 4"], 1),
        ("time,x\n0,1\n0.1,2\n0.2,", ["'x'", "line 4"], "nothing"),
        ("time,x\n0,1\n0.1,2\n0.2,-", "line 4", "'-'"),
        ("time,x\n0,1\n0.1,2\n0.2\n", ["2 values", "line 4"], 1),
        ("time,x,x,y,z\n0,1,2,3,4\n", "--axis", "x, x, y, z"),
        ("time;x\n0,5;1.23,5\n0,6;2\n0,7;2\n", "line 2", "'1.23,5'"),
        ("time,x\n0,1\n0.1,two\n", "numbers", "'two'"),
        ("0,1\n0.1,2\n", "header", "numbers"),
    ],
)
def test_refused_files(tmp_path: Path, text: str, expected: object, got: object) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with refused(InputError, names="a.csv", expected=expected, got=got):
        import_csv([path], [LABEL])


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
@pytest.mark.parametrize("axis", ["x", "dft321"])
def test_nan_and_inf_are_named(
    tmp_path: Path, axes: NDArray[np.float64], value: str, axis: str
) -> None:
    axes[0, 17] = float(value)
    path = write_csv(tmp_path / "a.csv", "time,x,y,z", with_time(axes))
    with refused(InputError, expected="line 19", got=f"'{value}'"):
        import_csv([path], [LABEL], axis=axis)  # type: ignore[arg-type]


def test_of_lost_samples_the_longest_part_is_left(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    columns = np.delete(with_time(axes[:1]), slice(700, 900), axis=1)
    path = write_csv(tmp_path / "a.csv", "time,x", columns)
    for rate_hz in (None, RATE_HZ):
        found = import_csv_file(path, LABEL, rate_hz=rate_hz)
        assert found.recording.rate_hz == pytest.approx(RATE_HZ)
        assert np.array_equal(found.recording.samples, axes[0, 900:])
        [told] = found.warnings
        check_refusal(told, names=["a.csv", "0.06281 s", "row 700", "700 of 1800"])
    with pytest.warns(UserWarning, match="0.06281 s"):
        import_csv([path], [LABEL])
    with refused(
        InputError, names="a.csv", expected="--rate", got=["3000 Hz", "'time'", "3200 Hz", "s"]
    ):
        import_csv([path], [LABEL], rate_hz=3000)


def test_falling_times_are_refused(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    columns = with_time(axes[:1])
    columns[0, 100] = 0.0
    path = write_csv(tmp_path / "a.csv", "time,x", columns)
    with refused(InputError, names=["a.csv", "--rate"], expected="times"):
        import_csv([path], [LABEL])


@pytest.mark.parametrize(
    ("rate_hz", "factor", "header"),
    [(3200, 1e3, "time"), (22_704, 1e3, "time"), (220_704, 1e6, "t"), (3200, 1e3, "time_s")],
)
def test_time_in_another_unit_is_noticed(
    tmp_path: Path, axes: NDArray[np.float64], rate_hz: int, factor: float, header: str
) -> None:
    columns = np.vstack([np.arange(2000) / rate_hz * factor, axes[0]])
    path = write_csv(tmp_path / "a.csv", f"{header},x", columns)
    with refused(
        InputError,
        names="a.csv",
        expected="Hz",
        got=[f"{rate_hz / factor:.4g} Hz", f"'{header}'", "ms", "us", "ns"],
    ):
        import_csv([path], [LABEL])
    given = import_csv([path], [LABEL], rate_hz=rate_hz).recordings[0]
    assert given.rate_hz == rate_hz
    named = write_csv(tmp_path / "b.csv", "time_ms,x" if factor == 1e3 else "time_us,x", columns)
    assert import_csv([named], [LABEL]).recordings[0].rate_hz == pytest.approx(rate_hz)


def test_seconds_that_may_be_milliseconds_are_refused_with_both_rates(tmp_path: Path) -> None:
    """As the accelerometer's evaluation tool is said to write, the first time an odd one."""
    rate_hz = 22_704.0
    path, count = tmp_path / "a.csv", round(0.205 * rate_hz)
    samples = np.random.default_rng(1).normal(0, 0.2, count)
    time_ms = (np.arange(count) / rate_hz * 1e3).round(6)
    time_ms[0] = 0.000011
    write_csv(path, "Time(s),az(g)", np.vstack([time_ms, samples]))
    with refused(InputError, names="a.csv", got=["'Time(s)'", "in s", "in ms"]) as error:
        import_csv([path], [LABEL], axis="z")
    offered = [float(rate) for rate in re.findall(r"([\d.]+) Hz with times", str(error.value))]
    assert offered == pytest.approx([rate_hz / 1000, rate_hz], rel=1e-4)
    for given in offered:
        taken = import_csv_file(path, LABEL, axis="z", rate_hz=given)
        assert not taken.doubts
        assert taken.recording.rate_hz == given
        assert np.array_equal(taken.recording.samples, samples)
        told = [sentence for sentence in taken.warnings if "'Time(s)'" in sentence]
        assert len(told) == (given > 1000)
    with refused(InputError, got=["3000 Hz", "in s", "in ms"]):
        import_csv([path], [LABEL], axis="z", rate_hz=3000)


def test_a_slow_log_that_can_be_nothing_else_is_only_told_of(tmp_path: Path) -> None:
    """Of a telephone: 2 s at 100 Hz would be 2 ms."""
    path = tmp_path / "a.csv"
    values = np.random.default_rng(1).normal(0, 0.2, 200)
    write_csv(path, "Time (s),z (g)", np.vstack([np.arange(200) / 100, values]))
    found = import_csv_file(path, LABEL)
    assert found.recording.rate_hz == pytest.approx(100)
    assert not found.doubts
    check_refusal(found.warnings[0], got=["100 Hz", "--rate"])


def test_decimal_commas_between_semicolons(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s;x_g;y_g;z_g", with_time(axes), delimiter=";")
    with_points = import_csv([path], [LABEL], axis="z")
    path.write_text(path.read_text().replace(".", ","))
    assert import_csv([path], [LABEL], axis="z") == with_points


def test_clipping_of_single_axes_is_seen_after_their_combination(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    limited = np.clip(axes, [[-0.5], [-0.4], [-9]], [[0.5], [9], [9]])
    stuck = limited != axes
    path = write_csv(tmp_path / "a.csv", "time_s,x_g,y_g,z_g", with_time(limited))
    combined = import_csv([path], [LABEL], axis="dft321")
    assert combined.recordings[0].clipped_share == stuck.any(axis=0).mean() > 0.1
    combined.save(tmp_path / "set")
    assert RecordingSet.load(tmp_path / "set") == combined
    for axis, share in zip(("x", "y", "z"), stuck.mean(axis=1), strict=True):
        single = import_csv([path], [LABEL], axis=axis).recordings[0]  # type: ignore[arg-type]
        assert single.clipped_share == share
    whole = write_csv(tmp_path / "b.csv", "time_s,x_g,y_g,z_g", with_time(axes))
    assert import_csv([whole], [LABEL], axis="dft321").recordings[0].clipped_share == 0.0


def write_wav(path: Path, samples: NDArray[np.float64], *, rate_hz: int = 10_000) -> Path:
    wavfile.write(path, rate_hz, np.round(samples * 32767).astype(np.int16))
    return path


def test_wav_in_g_and_in_arbitrary_units(tmp_path: Path) -> None:
    samples = np.random.default_rng(1).uniform(-0.5, 0.5, 15_000)
    path = write_wav(tmp_path / "a.wav", samples)
    arbitrary = import_wav([path], [LABEL]).recordings[0]
    in_g = import_wav([path], [LABEL], g_per_fullscale=16.0).recordings[0]
    assert (arbitrary.unit, in_g.unit) == ("arbitrary", "g")
    assert arbitrary.rate_hz == 10_000
    np.testing.assert_allclose(arbitrary.samples, samples, atol=1 / 32768)
    np.testing.assert_allclose(in_g.samples, 16 * arbitrary.samples, rtol=1e-15)


@pytest.mark.parametrize("full_scale", [0.0, -1.0, float("nan")])
def test_wav_with_a_meaningless_scale_is_refused(tmp_path: Path, full_scale: float) -> None:
    path = write_wav(tmp_path / "a.wav", np.sin(np.arange(1000.0)))
    with refused(InputError, names="a.wav", expected=["full scale", 0], got=full_scale):
        import_wav([path], [LABEL], g_per_fullscale=full_scale)
    label = Label("oak", 100.0, 1.0, g_per_fullscale=full_scale)
    with refused(InputError, names="a.wav", expected=["full scale", 0], got=full_scale):
        import_wav([path], [label], g_per_fullscale=16.0)


def test_noise_bytes_are_refused(tmp_path: Path) -> None:
    broken = tmp_path / "b.wav"
    broken.write_bytes(b"RIFF....WAVE")
    with refused(InputError, expected="WAV", got=broken):
        import_wav([broken], [LABEL])


def test_clipping_is_measured_and_accepted(tmp_path: Path) -> None:
    samples = np.clip(1.5 * np.sin(2 * np.pi * 100 * np.arange(10_000) / 10_000), -1, 1)
    recording = import_wav([write_wav(tmp_path / "c.wav", samples)], [LABEL]).recordings[0]
    # |1.5 sin| exceeds 1 for 1 − 2·asin(1/1.5)/π of the time.
    expected = 1 - 2 * np.arcsin(1 / 1.5) / np.pi
    assert recording.clipped_share == pytest.approx(expected, abs=0.02)


def test_labels_from_a_table(tmp_path: Path) -> None:
    table = tmp_path / "labels.tsv"
    table.write_text(
        "file\tspeed_mm_s\tforce_n\ttexture\trepeat\na.wav\t50\t0.5\toak\t1\nb.wav\t50\t0.5\t\t2\n"
    )
    labels, _ = labels_from_table(table, [Path("x/a.wav"), Path("b.wav")], texture="ash")
    assert labels == [Label("oak", 50.0, 0.5), Label("ash", 50.0, 0.5, 2)]
    with refused(InputError, expected=["c.wav", table], got="none"):
        labels_from_table(table, [Path("c.wav")], texture=None)
    table.write_text("file\tspeed_mm_s\tforce_n\na.wav\t50\t0.5\na.wav\t60\t0.5\n")
    with refused(InputError, names="a.wav", expected=["labels.tsv", "one"], got="several"):
        labels_from_table(table, [Path("a.wav")], texture="oak")


def test_empty_scale_is_none_given(tmp_path: Path) -> None:
    table = tmp_path / "labels.tsv"
    table.write_text("file\tspeed_mm_s\tforce_n\tg_per_fullscale\na.wav\t50\t1\t\n")
    labels, _ = labels_from_table(table, [Path("a.wav")], texture="oak")
    assert labels == [Label("oak", 50.0, 1.0)]
    path = write_wav(tmp_path / "a.wav", np.sin(np.arange(1000.0)) / 2)
    assert import_wav([path], labels, g_per_fullscale=16.0).recordings[0].unit == "g"


def test_cut_wav_is_refused(tmp_path: Path) -> None:
    path = write_wav(tmp_path / "a.wav", np.sin(np.arange(1000.0)) / 2)
    path.write_bytes(path.read_bytes()[:1000])
    with refused(InputError, expected=[2044, path], got=1000):
        import_wav([path], [LABEL])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings_comments_and_blank_lines(
    tmp_path: Path, axes: NDArray[np.float64], encoding: str
) -> None:
    header = "time (s),Linear Acceleration x (m/s²),Gyroscope x (rad/s)"
    path = write_csv(tmp_path / "a.csv", header, with_time(axes[:2]))
    text = "# phone, held flat\n" + path.read_text(encoding="utf-8") + "\n"
    path.write_text(text, encoding=encoding)
    recording = import_csv([path], [LABEL], axis="x").recordings[0]
    np.testing.assert_allclose(recording.samples, axes[0] / 9.80665, rtol=1e-12)
    assert recording.unit == "g"


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(bytes(range(256)) * 10)
    with refused(InputError, expected=["text", path], got="bytes"):
        import_csv([path], [LABEL])


def test_an_option_must_not_contradict_the_header(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,x_m_s2", with_time(axes[:1]))
    with refused(InputError, expected="a.csv", got=["'m/s2'", "'g'", "--unit"]):
        import_csv([path], [LABEL], unit="g")
    assert import_csv([path], [LABEL], unit="m/s²").recordings[0].unit == "g"


def test_an_option_is_taken_where_the_header_names_no_known_unit(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,x (LSB)", with_time(axes[:1]))
    with refused(InputError, expected="a.csv", got=["'lsb'", "--unit"]):
        import_csv_file(path, LABEL)
    found = import_csv_file(path, LABEL, unit="mg")
    np.testing.assert_allclose(found.recording.samples, axes[0] / 1000, rtol=1e-12)
    [told] = found.warnings
    check_refusal(told, names=["a.csv", "'lsb'", "mg", "--unit"])


@pytest.mark.parametrize(
    "header",
    [
        "time_s,gX,aY,temperature (C)",
        "time_s,gyro_x (rad/s),Acceleration (m/s²),accuracy",
        "time_s,x (dps),z (mg),force_n",
    ],
)
def test_the_only_acceleration_is_found_among_other_channels(
    tmp_path: Path, axes: NDArray[np.float64], header: str
) -> None:
    path = write_csv(tmp_path / "a.csv", header, with_time(axes))
    if "x (dps)" in header:  # an axis, too
        with refused(InputError, expected="--axis", got=["x (dps)", "z (mg)"]):
            import_csv_file(path, LABEL)
        return
    found = import_csv_file(path, LABEL)
    assert np.corrcoef(found.recording.samples, axes[1])[0, 1] == pytest.approx(1)
    assert f"'{header.split(',')[2]}'" in found.warnings[0]
    assert not import_csv_file(path, LABEL, named={"y": header.split(",")[2]}).warnings


def test_what_instruments_send_for_an_overload_is_named(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    axes[0, 41] = -9.9e37
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", with_time(axes[:1]))
    with refused(InputError, names="a.csv", expected="range", got=["9.9e+37", "row 42"]):
        import_csv_file(path, LABEL)


def test_one_broken_file_of_many_is_named_and_left_out(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    paths = [write_csv(tmp_path / f"{n}.csv", "time_s,x_g", with_time(axes[:1])) for n in range(3)]
    paths[1].write_text("nothing of use\n", encoding="utf-8")
    labels = [Label("oak", speed, 1.0) for speed in (100.0, 200.0, 300.0)]
    records, refusals = usable(import_csv_file, paths, labels)
    assert [one.recording.speed_mm_s for one in records] == [100.0, 300.0]
    [sentence] = refusals
    assert "1.csv" in sentence
    with refused(InputError, names="1.csv"):
        usable(import_csv_file, paths[1:2], labels[1:2])


@pytest.mark.parametrize("header", ["time_s", "time"])
@pytest.mark.parametrize("rate_hz", [5000.0, 3100.0, 1000.0, 3.2e6])
def test_a_rate_must_not_contradict_the_time_column(
    tmp_path: Path, axes: NDArray[np.float64], rate_hz: float, header: str
) -> None:
    path = write_csv(tmp_path / "a.csv", f"{header},x_g", with_time(axes[:1]))
    with refused(
        InputError,
        names="a.csv",
        expected="--rate",
        got=[f"{rate_hz:g} Hz", f"'{header}'", "3200 Hz", "s"],
    ):
        import_csv([path], [LABEL], rate_hz=rate_hz)
    assert import_csv([path], [LABEL], rate_hz=3201.0).recordings[0].rate_hz == 3201.0


@pytest.mark.parametrize("header", ["time_ns", "Time (ns)", "time", "timestamp_s", "time_ms"])
def test_a_rate_must_not_contradict_a_column_of_nanoseconds(
    tmp_path: Path, axes: NDArray[np.float64], header: str
) -> None:
    """Whether it says so or not: in no other unit is this a vibration's rate."""
    columns = with_time(axes[:1], scale=1e9) + np.array([[1.6e18], [0.0]])
    path = write_csv(tmp_path / "a.csv", f"{header},x_g", columns)
    with refused(
        InputError,
        names="a.csv",
        expected="--rate",
        got=["1000 Hz", header, "3200 Hz", "ns"],
    ):
        import_csv([path], [LABEL], rate_hz=1000.0)
    assert import_csv([path], [LABEL], rate_hz=RATE_HZ).recordings[0].rate_hz == RATE_HZ
    told = import_csv_file(path, LABEL, rate_hz=1000.0)
    assert (told.recording.rate_hz, len(told.doubts)) == (1000.0, 1)
    if "ns" in header or header == "time":  # without a unit times since 1970 tell theirs
        assert import_csv([path], [LABEL]).recordings[0].rate_hz == pytest.approx(RATE_HZ)


def test_a_column_that_counts_samples_or_falls_tells_no_rate(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    for times in (np.arange(2000.0), np.arange(2000.0) % 100, 1e-320 * np.arange(2000.0)):
        path = write_csv(tmp_path / "a.csv", "t,x_g", np.vstack([times, axes[0]]))
        assert import_csv([path], [LABEL], rate_hz=5000.0).recordings[0].rate_hz == 5000


def test_what_cannot_be_meant_is_refused(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    exchanged = Label("oak", 1.5, 160.0)
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", with_time(axes[:1] + 9.81))
    with refused(
        InputError,
        names="a.csv",
        expected=["3 to 1500 mm/s", "0.01 to 30 N"],
        got=["1.5 mm/s", "160 N", "160 mm/s"],
    ):
        import_csv([path], [exchanged])
    with refused(
        InputError, names="a.csv", expected="1.5 g", got=["9.82 g", "1 g", "m/s²", "--unit"]
    ):
        import_csv([path], [LABEL])
    assert len(import_csv_file(path, exchanged).doubts) == 2
    wav = write_wav(tmp_path / "a.wav", axes[0] / 3)
    with refused(
        InputError, names="a.wav", expected=[0.1, "2000 g"], got=["1e+06 g", "--g-per-fullscale"]
    ):
        import_wav([wav], [LABEL], g_per_fullscale=1e6)


def test_coarse_time_stamps_and_lost_samples_do_not_contradict_the_rate(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    coarse = np.floor(with_time(axes[:1]) * [[1000], [1]])  # 3.2 samples a millisecond
    path = write_csv(tmp_path / "a.csv", "time_ms,x_g", coarse)
    assert import_csv([path], [LABEL], rate_hz=RATE_HZ).recordings[0].rate_hz == RATE_HZ
    lost = np.delete(with_time(axes[:1]), slice(5, None, 20), axis=1)  # the mean step is 5 % longer
    path = write_csv(tmp_path / "b.csv", "time_s,x_g", lost)
    assert import_csv([path], [LABEL], rate_hz=RATE_HZ).recordings[0].rate_hz == RATE_HZ
    with refused(
        InputError, names="b.csv", expected="--rate", got=["6400 Hz", "'time_s'", "3040 Hz"]
    ):
        import_csv([path], [LABEL], rate_hz=2 * RATE_HZ)


@pytest.mark.parametrize("jitter_ms", [0.0, 0.02, 0.2])
def test_jitter_is_told_with_what_it_does(
    tmp_path: Path, axes: NDArray[np.float64], jitter_ms: float
) -> None:
    """Phone data: 400 Hz, of which a vibration at 200 Hz is the highest that is there."""
    time_s = np.arange(2000) / 400 + np.random.default_rng(2).normal(0, jitter_ms / 1000, 2000)
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", np.vstack([time_s, axes[0]]))
    even = import_csv_file(path, LABEL, rate_hz=400.0)
    assert np.array_equal(even.recording.samples, axes[0])
    if jitter_ms < 0.1:
        assert import_csv_file(path, LABEL).recording.samples.tolist() == axes[0].tolist()
        assert import_csv_file(path, LABEL).warnings == even.warnings == ()
        return
    # The power of a sinusoid at f with Gaussian jitter s falls to exp(-(2 pi f s)^2).
    share = 1 - np.exp(-((2 * np.pi * 200 * jitter_ms / 1000) ** 2))
    [told] = even.warnings
    found = re.search(r"\(([\d.]+) ms RMS\).* turns (\d+)% .* at 200 Hz into noise", told)
    assert found is not None
    assert float(found[1]) == pytest.approx(jitter_ms, rel=0.05)
    assert float(found[2]) == pytest.approx(100 * share, abs=1)
    [told] = import_csv_file(path, LABEL).warnings
    check_refusal(told, names=["a.csv", "--rate", f"{float(found[1]):g} ms RMS"])


@pytest.mark.parametrize("jitter", [0.1, 0.15, 0.2])
def test_samples_at_uneven_times_have_the_spectrum_of_even_ones(
    tmp_path: Path, jitter: float
) -> None:
    """Sinusoids of known phases, which have a value at any time."""
    rng = np.random.default_rng(1)
    frequencies_hz, phases = rng.uniform(5, 1550, 1500), rng.uniform(0, 2 * np.pi, 1500)
    heights = 0.02 / (1 + (frequencies_hz / 500) ** 2)

    def vibration(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        parts = np.array_split(time_s, 8)
        angles = (2 * np.pi * np.outer(part, frequencies_hz) + phases for part in parts)
        return np.concatenate([np.sin(angle) @ heights for angle in angles])

    even_s = np.arange(3 * 3200) / RATE_HZ
    uneven_s = np.sort(even_s + rng.normal(0, jitter / RATE_HZ, even_s.size))
    uneven_s[[0, -1]] = even_s[[0, -1]]
    columns = np.vstack([uneven_s, vibration(uneven_s)])
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", columns)
    found = import_csv_file(path, LABEL).recording
    assert found.rate_hz == pytest.approx(RATE_HZ, rel=1e-9)
    assert found.samples.size == even_s.size

    def error_db(samples: NDArray[np.float64]) -> float:
        """RMS over lines of 20 Hz from 10 to 1000 Hz."""
        ours, truth = (welch(x, RATE_HZ, nperseg=160)[1] for x in (samples, vibration(even_s)))
        return float(np.sqrt(np.mean((10 * np.log10(ours / truth)[1:51]) ** 2)))

    taken_as_even = import_csv_file(path, LABEL, rate_hz=RATE_HZ).recording.samples
    assert error_db(found.samples) < min(0.05, error_db(taken_as_even) / 3)


def test_a_time_that_repeats_is_passed_over(tmp_path: Path) -> None:
    time_s = np.arange(4000) / 400 + np.random.default_rng(2).normal(0, 2e-4, 4000)
    time_s[1000] = time_s[999]
    columns = np.vstack([time_s, np.sin(2 * np.pi * 60 * time_s)])
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", columns)
    found = import_csv_file(path, LABEL).recording
    even_s = time_s[0] + np.arange(found.samples.size) / found.rate_hz
    away = found.samples - np.sin(2 * np.pi * 60 * even_s)
    assert np.abs(away[20:-20]).max() < 1e-3


# --- Phones, data loggers and other header words


def test_nanoseconds_since_1970_are_exact(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    """Sensor Logger: two time columns, axes from z to x, no units in the header."""
    first_ns, step_ns = 1_732_000_000_123_456_789, 2_481_390
    rows = [
        f"{first_ns + n * step_ns},{n * step_ns / 1e9:.9f},{z!r},{y!r},{x!r}"
        for n, (x, y, z) in enumerate(axes.T.tolist())
    ]
    path = tmp_path / "Accelerometer.csv"
    path.write_text("\n".join(["time,seconds_elapsed,z,y,x", *rows]) + "\n")
    told = import_csv_file(path, LABEL, axis="z", unit="m/s2")
    assert told.warnings == ()
    assert told.recording.rate_hz == pytest.approx(1e9 / step_ns, rel=1e-12)
    np.testing.assert_allclose(told.recording.samples, axes[2] / 9.80665, rtol=1e-15)
    for column in ("time", "seconds_elapsed"):
        same = import_csv_file(path, LABEL, axis="z", unit="m/s2", named={"time": column})
        assert same.recording.rate_hz == pytest.approx(1e9 / step_ns, rel=1e-9)


@pytest.mark.parametrize(("unit", "scale"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_times_since_1970_tell_their_unit(
    tmp_path: Path, axes: NDArray[np.float64], unit: str, scale: float
) -> None:
    columns = with_time(axes[:1], scale=scale) + np.array([[1.73e9 * scale], [0.0]])
    path = write_csv(tmp_path / "a.csv", "timestamp,x", columns)
    found = import_csv([path], [LABEL]).recordings[0]
    assert found.rate_hz == pytest.approx(RATE_HZ, rel=1e-3)


def test_a_column_of_times_is_named(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    columns = np.vstack([np.arange(2000.0), with_time(axes, scale=1e3)])
    path = write_csv(tmp_path / "a.csv", "time,Zeit [ms],Beschl_X,Beschl_Y,Beschl_Z (g)", columns)
    named = {"time": "Zeit", "z": "Beschl_Z"}
    found = import_csv([path], [LABEL], axis="z", named=named).recordings[0]
    assert found.rate_hz == pytest.approx(RATE_HZ)
    assert (found.unit, found.samples.tolist()) == ("g", axes[2].tolist())
    with refused(InputError, names=["a.csv", "--map"], expected="'Uhr'", got="Zeit"):
        import_csv([path], [LABEL], axis="z", named={"time": "Uhr"})


def test_a_map_of_columns_is_read() -> None:
    assert parse_columns("time=Zeit, z=Beschl Z") == {"time": "Zeit", "z": "Beschl Z"}
    for text, got in (("q=a", "'q=a'"), ("x=", "'x='"), ("x=a,x=b", "'x=b'")):
        with refused(InputError, expected="map", got=got):
            parse_columns(text)


@pytest.mark.parametrize(
    ("header", "options", "g_per_number"),
    [
        ("time_s,CH1 (V)", {}, 10.0),
        ("time_s,CH1 [mV]", {}, 0.01),
        ("time_s,x_mV", {"axis": "x"}, 0.01),
        ("time_s,Voltage", {"unit": "V"}, 10.0),
    ],
)
def test_a_log_in_volts_needs_the_sensitivity(
    tmp_path: Path,
    axes: NDArray[np.float64],
    header: str,
    options: dict[str, str],
    g_per_number: float,
) -> None:
    columns = with_time(axes[:1] / g_per_number)
    path = write_csv(tmp_path / "a.csv", header, columns)
    found = import_csv([path], [LABEL], mv_per_g=100.0, **options).recordings[0]  # type: ignore[arg-type]
    assert found.unit == "g"
    np.testing.assert_allclose(found.samples, axes[0], rtol=1e-12)
    with refused(InputError, names=["a.csv", "--mv-per-g"], got="none"):
        import_csv([path], [LABEL], **options)  # type: ignore[arg-type]
    for value in (0.0, -1.0, float("nan"), float("inf")):
        with refused(InputError, expected="--mv-per-g", got=value):
            import_csv([path], [LABEL], mv_per_g=value, **options)  # type: ignore[arg-type]


def test_a_sensitivity_of_what_is_no_voltage_is_refused(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", with_time(axes[:1]))
    with refused(InputError, names="a.csv", expected="--mv-per-g", got="'g'"):
        import_csv([path], [LABEL], mv_per_g=100.0)


@pytest.mark.parametrize(
    ("head", "time_scale", "end", "options"),
    [
        # phyphox, a phone, in CSV (comma, decimal point)
        (
            '"Time (s)","Linear Acceleration x (m/s^2)","Linear Acceleration y (m/s^2)",'
            '"Linear Acceleration z (m/s^2)","Absolute acceleration (m/s^2)"',
            1.0,
            ",1.0",
            {"axis": "z"},
        ),
        # PicoScope: units in a line of their own
        ("Time,Channel A,Channel B,Channel C\n(ms),(mV),(mV),(mV)\n", 1e3, "", CHANNEL_C),
        # The same as its manual shows it: microseconds, blanks behind the separators
        ("Time, Channel A, Channel B, Channel C\n(µs), (mV), (mV), (mV)\n", 1e6, "", CHANNEL_C),
        # WaveForms: comments, then the header
        (
            "#Digilent WaveForms Oscilloscope Acquisition\n#Device Name: Discovery2\n"
            "#Sample rate: 3200Hz\n\nTime (s),Channel 1 (V),Channel 2 (V),Channel 3 (V)",
            1.0,
            "",
            {"mv_per_g": 1000.0, "named": {"z": "Channel 3"}},
        ),
    ],
)
def test_files_of_a_phone_and_of_two_loggers(
    tmp_path: Path,
    axes: NDArray[np.float64],
    head: str,
    time_scale: float,
    end: str,
    options: dict[str, Any],
) -> None:
    """In the forms that their documentation shows, with numbers of ours."""
    numbers = with_time(axes, scale=time_scale).T.tolist()
    rows = [",".join(f"{value:.9g}" for value in row) + end for row in numbers]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([head, *rows]) + "\n")
    told = import_csv_file(path, LABEL, **options)
    assert told.warnings == ()
    assert told.recording.unit == "g"
    assert told.recording.rate_hz == pytest.approx(RATE_HZ, rel=1e-6)
    scale = 9.80665 if "m/s^2" in head else 1.0
    np.testing.assert_allclose(told.recording.samples, axes[2] / scale, rtol=1e-8)


LVM = """LabVIEW Measurement
Writer_Version	2
Separator	Tab
***End_of_Header***
Channels	1
***End_of_Header***
X_Value	Acceleration	Comment
"""


def test_a_labview_measurement_file_is_read(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    path = tmp_path / "a.lvm"
    time_s, x = with_time(axes[:1])
    rows = (f"{t:.6f}\t{v!r}\n" for t, v in zip(time_s.tolist(), x.tolist(), strict=True))
    path.write_text(LVM + "".join(rows))
    found = import_csv_file(path, LABEL, named={"time": "X_Value", "x": "Acceleration"})
    np.testing.assert_array_equal(found.recording.samples, axes[0])
    assert "6 lines" in found.warnings[0]


def test_a_rate_that_wanders_slowly_is_no_jitter(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    even_s = np.arange(2000) / 400
    wandering_s = even_s + 3e-3 * np.sin(2 * np.pi * even_s / 2)  # the rate changes by 1 %
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", np.vstack([wandering_s, axes[0]]))
    assert import_csv_file(path, LABEL).warnings == ()


@pytest.mark.parametrize("rate_hz", [3200.0, 700.0, 416.7, 999.0])
@pytest.mark.parametrize("digits", [3, 4, 6])
def test_rounded_time_stamps_are_no_jitter(tmp_path: Path, rate_hz: float, digits: int) -> None:
    time_s = np.round(1.6e9 + np.arange(3000) / rate_hz, digits)
    columns = np.vstack([time_s, np.random.default_rng(3).normal(0, 0.3, 3000)])
    path = write_csv(tmp_path / "a.csv", "timestamp,x_g", columns)
    assert import_csv_file(path, LABEL).warnings == ()


def test_a_whole_last_row_without_a_line_end_is_read_with_a_warning(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", with_time(axes[:1]))
    whole = import_csv_file(path, LABEL)
    assert whole.warnings == ()
    path.write_text(path.read_text().rstrip("\n"))
    read = import_csv_file(path, LABEL)
    assert read.recording == whole.recording
    [told] = read.warnings
    assert f"its last number, {float(axes[0, -1])}, may be cut short" in told


def test_a_channel_is_chosen_by_option_or_label(tmp_path: Path) -> None:
    channels = np.random.default_rng(4).uniform(-0.5, 0.5, (3000, 3)).astype(np.float32)
    path = tmp_path / "three.wav"
    wavfile.write(path, 10_000, channels)
    with refused(InputError, names=[path, "--channel"], expected="channel", got=3):
        import_wav([path], [LABEL])
    second = import_wav([path], [LABEL], channel=2).recordings[0]
    assert np.array_equal(second.samples, channels[:, 1])
    label = Label("oak", 100.0, 1.0, channel=3)
    third = import_wav([path], [label], channel=2).recordings[0]
    assert np.array_equal(third.samples, channels[:, 2])
    with refused(InputError, expected=["channel", 1, 3, path], got=4):
        import_wav([path], [LABEL], channel=4)
    table = tmp_path / "labels.tsv"
    table.write_text("file\tspeed_mm_s\tforce_n\tchannel\nthree.wav\t100\t1\t3\n")
    labels, _ = labels_from_table(table, [path], texture="oak")
    assert labels == [label]


def test_floats_beyond_the_full_scale_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.wav"
    samples = np.random.default_rng(4).uniform(-1, 1, 4000).astype(np.float32)
    samples[70] = 3.25
    wavfile.write(path, 10_000, samples)
    for options, taken in (({}, "in arbitrary units"), ({"g_per_fullscale": 16.0}, "as 52 g")):
        [told] = import_wav_file(path, LABEL, **options).warnings
        assert f"samples up to 3.25, beyond the full scale of 1, and they are taken {taken}" in told
        assert "give --g-per-fullscale 1" in told
    assert import_wav_file(path, LABEL, g_per_fullscale=1.0).warnings == ()
    samples[70] = 1.0
    wavfile.write(path, 10_000, samples)
    assert import_wav_file(path, LABEL).warnings == ()


def test_recordings_too_short_for_models_are_told(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,x_g", with_time(axes[:1, :64]))
    [told] = import_csv_file(path, LABEL).warnings
    assert "lasts 0.02 s; models need 0.2 s or more" in told
    wav = write_wav(tmp_path / "a.wav", axes[0, :1999] / 3)
    assert "lasts 0.2 s" in import_wav_file(wav, LABEL).warnings[0]
    wav = write_wav(tmp_path / "b.wav", axes[0, :2000] / 3)
    assert import_wav_file(wav, LABEL).warnings == ()


def test_columns_that_nobody_knows_and_rows_that_nobody_uses_are_named(tmp_path: Path) -> None:
    table = tmp_path / "labels.tsv"
    table.write_text("file\tspeed_mm_s\tforce_n\trepaet\na.wav\t50\t1\t2\n")
    with refused(
        InputError, names=table, expected=["file", "repeat"], got=["'repaet'", "'repeat'"]
    ):
        labels_from_table(table, [Path("a.wav")], texture="oak")
    table.write_text("file\tspeed_mm_s\tforce_n\tzzz\na.wav\t50\t1\t2\n")
    with refused(InputError, names=table, expected="file", got="'zzz'"):
        labels_from_table(table, [Path("a.wav")], texture="oak")
    table.write_text("file\tspeed_mm_s\tforce_n\na.wav\t50\t1\nb.wav\t60\t1\nc.wav\t70\t1\n")
    labels, unused = labels_from_table(table, [Path("b.wav")], texture="oak")
    assert ([label.speed_mm_s for label in labels], unused) == ([60.0], ("a.wav", "c.wav"))
