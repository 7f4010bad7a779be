"""Files of other equipment: what is read, and what is refused with one sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import wavfile

from modeling import InputError, RecordingSet
from rig.importing.files import Label, import_csv, import_wav, labels_from_table, usable

LABEL = Label("oak", 100.0, 1.0)
RATE_HZ = 3200.0


@pytest.fixture
def axes() -> NDArray[np.float64]:
    return np.random.default_rng(5).normal(0, 0.3, (3, 2000))


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
    ("header", "options", "sentence"),
    [
        ("x,y,z", {"axis": "x"}, "expected a time column or --rate"),
        ("time,x,y,z", {}, "expected --axis x, y, z or dft321"),
        ("time,x,y,q", {"axis": "dft321"}, "expected columns named x, y, z"),
        ("time,x,ax,z", {"axis": "x"}, "expected columns named x .each once."),
        ("time,x,y,ay", {"axis": "dft321"}, "expected columns named x, y, z .each once."),
        ("time,x,y,z", {"axis": "w"}, "expected an axis among"),
        ("time,x (furlong),y,z", {"axis": "x"}, "got 'furlong'"),
        ("time,x,y,z", {"axis": "x", "unit": "stone"}, "got 'stone'"),
        ("time_h,x,y,z", {"axis": "x"}, "expected a time column or --rate"),
    ],
)
def test_refused_layouts(
    tmp_path: Path,
    axes: NDArray[np.float64],
    header: str,
    options: dict[str, str],
    sentence: str,
) -> None:
    columns = axes if header.startswith("x") else with_time(axes)
    path = write_csv(tmp_path / "a.csv", header, columns)
    with pytest.raises(InputError, match=sentence) as caught:
        import_csv([path], [LABEL], **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "got 0 lines"),
        ("time,x\n", "got 1 lines"),
        ("time,x\n0,1\n0.1,2\n0.2", "add a line end if the file is complete"),
        ("time,x\n0,1\n0.1,2\n0.2,3", "add a line end if the file is complete"),
        ("time,x\n0,1\n0.1,2\n0.2\n", "truncated or damaged"),
        ("time,x,x,y,z\n0,1,2,3,4\n", "each column name once"),
        ("time;x\n0,5;1.234,5\n", "a cell that is none"),
        ("time,x\n0,1\n0.1,two\n", "a cell that is none"),
        ("0,1\n0.1,2\n", "expected a header line"),
    ],
)
def test_refused_files(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        import_csv([path], [LABEL])


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
@pytest.mark.parametrize("axis", ["x", "dft321"])
def test_nan_and_inf_are_named(
    tmp_path: Path, axes: NDArray[np.float64], value: str, axis: str
) -> None:
    axes[0, 17] = float(value)
    path = write_csv(tmp_path / "a.csv", "time,x,y,z", with_time(axes))
    with pytest.raises(InputError, match="NaN or inf"):
        import_csv([path], [LABEL], axis=axis)  # type: ignore[arg-type]


def test_lost_samples_are_noticed(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    columns = np.delete(with_time(axes[:1]), slice(700, 900), axis=1)
    path = write_csv(tmp_path / "a.csv", "time,x", columns)
    with pytest.raises(InputError, match="samples are missing"):
        import_csv([path], [LABEL])


def test_falling_times_are_refused(tmp_path: Path, axes: NDArray[np.float64]) -> None:
    columns = with_time(axes[:1])
    columns[0, 100] = 0.0
    path = write_csv(tmp_path / "a.csv", "time,x", columns)
    with pytest.raises(InputError, match="rising times"):
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
    with pytest.raises(InputError, match="is time in ms or us"):
        import_csv([path], [LABEL])
    given = import_csv([path], [LABEL], rate_hz=rate_hz).recordings[0]
    assert given.rate_hz == rate_hz
    named = write_csv(tmp_path / "b.csv", "time_ms,x" if factor == 1e3 else "time_us,x", columns)
    assert import_csv([named], [LABEL]).recordings[0].rate_hz == pytest.approx(rate_hz)


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
    with pytest.raises(InputError, match="g per full scale above 0"):
        import_wav([path], [LABEL], g_per_fullscale=full_scale)
    label = Label("oak", 100.0, 1.0, g_per_fullscale=full_scale)
    with pytest.raises(InputError, match="g per full scale above 0"):
        import_wav([path], [label], g_per_fullscale=16.0)


def test_stereo_and_noise_bytes_are_refused(tmp_path: Path) -> None:
    stereo = tmp_path / "s.wav"
    wavfile.write(stereo, 10_000, np.ones((100, 2), dtype=np.int16))
    with pytest.raises(InputError, match="one channel"):
        import_wav([stereo], [LABEL])
    broken = tmp_path / "b.wav"
    broken.write_bytes(b"RIFF....WAVE")
    with pytest.raises(InputError, match="expected a WAV file"):
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
    labels = labels_from_table(table, [Path("x/a.wav"), Path("b.wav")], texture="ash")
    assert labels == [Label("oak", 50.0, 0.5), Label("ash", 50.0, 0.5, 2)]
    with pytest.raises(InputError, match=r"expected a row for c\.wav"):
        labels_from_table(table, [Path("c.wav")], texture=None)
    table.write_text("file\tspeed_mm_s\tforce_n\na.wav\tfast\t0.5\n")
    with pytest.raises(InputError, match="speed_mm_s"):
        labels_from_table(table, [Path("a.wav")], texture=None)


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ("a.wav\t50\t0.5\t1.5\t", "whole number for repeat of a.wav"),
        ("a.wav\t50\t0.5\tinf\t", "whole number for repeat of a.wav"),
        ("a.wav\t50\t0.5\tnan\t", "whole number for repeat of a.wav"),
        ("a.wav\t50\t0.5\t0\t", "at least 1, got 0"),
        ("a.wav\t50\t0.5\t-1\t", "at least 1, got -1"),
        ("a.wav\t50\t0.5\t1\t0", "g per full scale above 0, got 0"),
        ("a.wav\t50\t0.5\t1\t-16", "g per full scale above 0, got -16"),
        ("a.wav\t50\t0.5\t1\tloud", "number for g_per_fullscale of a.wav"),
        ("a.wav\t50\t0.5\t1\t\na.wav\t60\t0.5\t2\t", "one row for a.wav"),
    ],
)
def test_refused_labels(tmp_path: Path, row: str, sentence: str) -> None:
    table = tmp_path / "labels.tsv"
    table.write_text(f"file\tspeed_mm_s\tforce_n\trepeat\tg_per_fullscale\n{row}\n")
    with pytest.raises(InputError, match=sentence):
        labels_from_table(table, [Path("a.wav")], texture="oak")


def test_empty_scale_is_none_given(tmp_path: Path) -> None:
    table = tmp_path / "labels.tsv"
    table.write_text("file\tspeed_mm_s\tforce_n\tg_per_fullscale\na.wav\t50\t1\t\n")
    labels = labels_from_table(table, [Path("a.wav")], texture="oak")
    assert labels == [Label("oak", 50.0, 1.0)]
    path = write_wav(tmp_path / "a.wav", np.sin(np.arange(1000.0)) / 2)
    assert import_wav([path], labels, g_per_fullscale=16.0).recordings[0].unit == "g"


def test_cut_wav_is_refused(tmp_path: Path) -> None:
    path = write_wav(tmp_path / "a.wav", np.sin(np.arange(1000.0)) / 2)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(InputError, match="truncated"):
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
    with pytest.raises(InputError, match="other bytes"):
        import_csv([path], [LABEL])


def test_an_option_must_not_contradict_the_header(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    path = write_csv(tmp_path / "a.csv", "time_s,x_m_s2", with_time(axes[:1]))
    with pytest.raises(InputError, match=r"'m/s2' in its header and 'g' from --unit"):
        import_csv([path], [LABEL], unit="g")
    assert import_csv([path], [LABEL], unit="m/s2").recordings[0].unit == "g"


def test_one_broken_file_of_many_is_named_and_left_out(
    tmp_path: Path, axes: NDArray[np.float64]
) -> None:
    paths = [write_csv(tmp_path / f"{n}.csv", "time_s,x_g", with_time(axes[:1])) for n in range(3)]
    paths[1].write_text("nothing of use\n", encoding="utf-8")
    labels = [Label("oak", speed, 1.0) for speed in (100.0, 200.0, 300.0)]
    records, refusals = usable(import_csv, paths, labels)
    assert [r.speed_mm_s for r in records] == [100.0, 300.0]
    [sentence] = refusals
    assert "1.csv" in sentence
    with pytest.raises(InputError, match=r"1\.csv"):
        usable(import_csv, paths[1:2], labels[1:2])
