"""Logs of other programs, in their layouts: header, units, columns beside, decimal signs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.rig.recording.importing.csv_columns import parse_columns
from tactileq.rig.recording.importing.files import import_csv_file
from tactileq.rig.recording.importing.labels import Label
from tests.refusals import refused

LABEL = Label("oak", 100.0, 1.0)
RATE_HZ = 2000.0
Z = np.random.default_rng(7).normal(1.0, 0.2, 400).round(5)
TIME_S = (np.arange(Z.size) / RATE_HZ).round(4)


def log(head: str, row: str, *, tail: str = "", line_end: str = "\n") -> str:
    """A log whose rows hold {t} seconds, {ms} milliseconds, {n} from 0 and {z} g."""
    rows = (
        row.format(t=f"{t:.4f}", ms=f"{1e3 * t:.1f}", n=n, z=f"{z:.5f}", **others(z))
        for n, (t, z) in enumerate(zip(TIME_S.tolist(), Z.tolist(), strict=True))
    )
    return (head + "".join(f"{line}\n" for line in rows) + tail).replace("\n", line_end)


def others(z: float) -> dict[str, str]:
    return {"mg": f"{1e3 * z:.2f}", "si": f"{9.80665 * z:.5f}"}


LOGS = {
    "names and units": (log("x-axis,1\nsecond,Volt\n", "{t},{z}"), "time=x-axis,x=1", {"v": 1.0}),
    "settings above": (
        log("Record Length,Analog:400\nSample Rate,2000.0\nSecond,Volt\n", "{t},{z}"),
        "time=Second,x=Volt",
        {"v": 1.0},
    ),
    "numbered, with settings beside": (
        log("X,CH1,Start,Increment,\nSequence,VOLT,-5.0e-01,5.0e-04\n", "{n},{z},,"),
        "x=CH1",
        {"v": 1.0, "rate_hz": RATE_HZ, "unit": "V"},
    ),
    "no header": (log("", "Length,400,,{t},{z},"), "time=#4,x=#5", {"v": 1.0, "unit": "V"}),
    "lines of a start": (log("SD online\nlogging\ntime_ms,z_mg\n", "{ms},{mg}"), "", {}),
    "a blank line": (log("Model: a\n\nTime (s),Acc Z (g)\n", "{t},{z}"), "", {}),
    "its separator": (log("sep=\t\nS1_Timestamp\tS1_Z\nms\tg\n", "{ms}\t{z}"), "", {}),
    "clocks beside": (
        log("rtcDate,rtcTime,aZ,Hz,\n", "07/01/2020,12:35:38.00,{mg},2000.1,"),
        "",
        {"axis": "z", "unit": "mg", "rate_hz": RATE_HZ},
    ),
    "a text beside": (log("time_s,z_g,surface\n", "{t},{z},cork"), "", {}),
    "no number beside": (log("time_s,z_g,c\n", "{t},{z},-nan(ind)"), "", {"axis": "z"}),
    "two of a name beside": (log("time_s,z_g,dN,dN\n", "{t},{z},1,2"), "", {"axis": "z"}),
    "nothing beside": (log("time_s,z_g,gps\n", "{t},{z},"), "", {"axis": "z"}),
    "a comma in the name": (
        log('t (s),"Z, up (g)"\n', "{t},{z}"),
        'time=t (s),z="Z, up (g)"',
        {},
    ),
    "names of rows": (log('"time_s"\t"z_g"\n', '"r{n}"\t{t}\t{z}'), "", {}),
    "lines at the end": (log("time_s,z_g\n", "{t},{z}", tail="END OF FILE\n"), "", {}),
    "sums at the end": (log("time_s,z_g\n", "{t},{z}", tail="Mean,1.0\nSD:,0.2\n"), "", {}),
    "quotes everywhere": (log('"time_s","z_g"\n', '"{t}","{z}"'), "", {}),
    "old Macs": (log("time_s,z_g\n", "{t},{z}", line_end="\r"), "", {}),
    "Windows": (log("time_s;z_g\n", "{t};{z}", line_end="\r\n"), "", {}),
    "units, one of them unknown": (
        log("Time,Acc,Temp\ns,g,°C\n", "{t},{z},21.5"),
        "time=Time,z=Acc",
        {},
    ),
    "a unit with brackets": (log("T,A\nms,m/(s^2)\n", "{ms},{si}"), "time=T,z=A", {}),
    "three lines of names": (log("t,A_Z\nCAL,CAL\nms,g\n", "{ms},{z}"), "time=t,z=A_Z", {}),
    "units, the last one blank": (log("Time,acc_z,Count\ns,g,\n", "{t},{z},1"), "", {"axis": "z"}),
    "names in a comment of blanks": (log("# time_s z_g\n", "{t} {z}"), "", {}),
    "a flag in every other row": (
        log("time_s,z_g,flag\n", "{t},{z},on").replace("1,on\n", "1,off\n"),
        "",
        {"axis": "z"},
    ),
    "unseen letters": (log("\u200btime_s,z_g\n", "{t},{z}"), "", {}),
    "names in a comment": (log("# time_s,z_g\n", "{t},{z}"), "", {}),
    "comments": (log("#Device: a\n#Rate: 2 kHz\ntime_s,z_g\n", "{t},{z}"), "", {}),
    "a start, no names": (log("started\n", "{t},{z}"), "time=#1,z=#2", {"unit": "g"}),
    "the rest of a row": (log("7,0.95\ntime_s,z_g\n", "{t},{z}"), "", {}),
    "names with blanks": (
        log("  Time [s]   Acc Z [g]\n", "  {t}  {z}"),
        "time=#1,z=#2",
        {"unit": "g"},
    ),
    "filled with nothing": (log("time_s,z_g\n", "{t},{z}", tail="\0" * 99), "", {}),
    "a mark twice": (log("\ufeff\ufefftime_s,z_g\n", "{t},{z}"), "time=time_s,z=z_g", {}),
    "only a unit": (log("time_s,g\n", "{t},{z}"), "", {}),
    "blanks": (log("  time_s     z_g\n", "  {t}   {z}"), "", {}),
}


@pytest.mark.parametrize("name", LOGS)
def test_logs_in_the_layouts_of_programs(tmp_path: Path, name: str) -> None:
    text, mapping, options = LOGS[name]
    (tmp_path / "a.csv").write_bytes(text.encode())
    given = {key: value for key, value in options.items() if key != "v"}
    if "v" in options:
        given["mv_per_g"] = 1000.0
    named = parse_columns(mapping) if mapping else {}
    found = import_csv_file(tmp_path / "a.csv", LABEL, named=named, **given)
    assert found.recording.rate_hz == pytest.approx(RATE_HZ)
    assert found.recording.unit == "g"
    np.testing.assert_allclose(found.recording.samples, Z, atol=1e-5)


@pytest.mark.parametrize("separator", ["\t", ";"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
def test_decimal_commas(tmp_path: Path, separator: str, encoding: str) -> None:
    text = log(f'"Zeit (s)"{separator}"Beschl z (m/s²)"\n', "{t}" + separator + "{z}")
    (tmp_path / "a.csv").write_bytes(text.replace(".", ",").encode(encoding))
    named = parse_columns("time=Zeit,z=Beschl z")
    found = import_csv_file(tmp_path / "a.csv", LABEL, named=named)
    np.testing.assert_allclose(found.recording.samples, Z / 9.80665, atol=1e-6)


def test_thousands_are_decided_with_the_times(tmp_path: Path) -> None:
    rows = [
        f"{1e3 * t:.1f};{1e3 * z:,.0f}"
        for t, z in zip(TIME_S.tolist(), (Z + 0.2).tolist(), strict=True)
    ]
    (tmp_path / "a.csv").write_text("\n".join(("time_ms;z_mg", *rows, "")))
    found = import_csv_file(tmp_path / "a.csv", LABEL)
    np.testing.assert_allclose(found.recording.samples, Z + 0.2, atol=6e-4)
    whole = [f"{n};{row.partition(';')[2]}" for n, row in enumerate(rows)]
    (tmp_path / "a.csv").write_text("\n".join(("n;z_mg", *whole, "")))
    with refused(InputError, expected="one reading", got=["or", "decimal=point"]):
        import_csv_file(tmp_path / "a.csv", LABEL, axis="z", rate_hz=RATE_HZ)
    named = {"decimal": "."}
    found = import_csv_file(tmp_path / "a.csv", LABEL, axis="z", rate_hz=RATE_HZ, named=named)
    np.testing.assert_allclose(found.recording.samples, Z + 0.2, atol=6e-4)


@pytest.mark.parametrize(
    ("line", "damage", "expected", "got"),
    [
        (50, "0.0250", ["2 values", "line 51"], 1),
        (50, "0.0250,1,2", ["2 values", "line 51"], 3),
        (50, "0.0250,", ["'z_g'", "line 51"], "nothing"),
        (50, "0.0250,1_1", ["'z_g'", "line 51"], "'1_1'"),
        (50, "0.0250,OL", ["range", "line 51"], "'OL'"),
        (50, '0.0250,"1', ["quotes", "line 51"], "not closed"),
        (399, "0.19", ["2 values", "line 400"], 1),
    ],
)
def test_a_damaged_line_is_named(
    tmp_path: Path, line: int, damage: str, expected: object, got: object
) -> None:
    lines = log("time_s,z_g\n", "{t},{z}").splitlines()
    lines[line] = damage
    (tmp_path / "a.csv").write_text("\n".join(lines[: max(line + 1, 200)]) + "\n")
    with refused(InputError, expected=expected, got=got):
        import_csv_file(tmp_path / "a.csv", LABEL)


def test_a_header_in_the_middle_is_a_new_start(tmp_path: Path) -> None:
    lines = log("time_s,z_g\n", "{t},{z}").splitlines()
    again = [*lines[:301], lines[0], *lines[1:101]]
    (tmp_path / "a.csv").write_text("\n".join(again) + "\n")
    found = import_csv_file(tmp_path / "a.csv", LABEL)
    np.testing.assert_allclose(found.recording.samples, Z[:300], atol=1e-5)
    assert any("header" in told and "line 302" in told for told in found.warnings)


REFUSED = {
    "unit of the file": ("time,A,B\ns,m/s²,-\n", "{t},{z},1", {"unit": "g", "axis": None}, "'g'"),
    "gyroscope": ("time_s,Gyroscope z\n", "{t},{z}", {"unit": "g"}, "'Gyroscope z'"),
    "magnetometer": ("time_s,Mag_Z (G)\n", "{t},{z}", {}, "'Mag_Z (G)'"),
    "weight": ("time_s,Weight (g)\n", "{t},{z}", {}, "'Weight (g)'"),
    "two tables": ("time_s,z_g,,time_ms,y_g\n", "{t},{z},,{t},{z}", {"axis": "z"}, "Hz by"),
    "no numbers": ("time_s,z\n", "{t},{z} g", {}, "none"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_acceleration_or_not_one_is_refused(tmp_path: Path, name: str) -> None:
    head, row, options, got = REFUSED[name]
    (tmp_path / "a.csv").write_text(log(head, row))
    named = {"time": "time", "z": "A"} if name == "unit of the file" else {}
    with refused(InputError, names="a.csv", got=got):
        import_csv_file(tmp_path / "a.csv", LABEL, named=named, **options)


def test_rows_are_neither_spliced_nor_mixed(tmp_path: Path) -> None:
    head, *lines = log("time_s,z_g\n", "{t},{z}").splitlines()
    marked = [f"#{line}" if 150 < n < 160 else line for n, line in enumerate(lines)]
    restarted = [*lines[:300], "Boot", head, *lines[:50]]
    late = [*lines[:50], "Boot", head, *lines[:300]]
    for rows, place in ((marked, "line 153"), (restarted, "line 304"), (late, "line 52")):
        (tmp_path / "a.csv").write_text("\n".join((head, *rows, "")))
        with pytest.raises(InputError, match=rf"a\.csv.*{place}|{place} of .*a\.csv"):
            import_csv_file(tmp_path / "a.csv", LABEL)
    long = [f"{line.replace(',', f',{kind},')}" for line in lines for kind in ("acc", "gyro")]
    (tmp_path / "a.csv").write_text("\n".join(("time_s,sensor,z_g", *long, "")))
    with refused(InputError, expected="channel", got=["acc, gyro", "'sensor'"]):
        import_csv_file(tmp_path / "a.csv", LABEL)


def test_one_column_with_decimal_commas(tmp_path: Path) -> None:
    text = log("z_g\n", "{z}").replace(".", ",")
    (tmp_path / "a.csv").write_text(text)
    found = import_csv_file(tmp_path / "a.csv", LABEL, rate_hz=RATE_HZ)
    np.testing.assert_allclose(found.recording.samples, Z, atol=1e-5)


def test_the_finer_of_two_clocks_is_taken(tmp_path: Path) -> None:
    rows = (
        f"{t:.2f},{1e3 * t:.1f},{z:.5f}" for t, z in zip(TIME_S.tolist(), Z.tolist(), strict=True)
    )
    (tmp_path / "a.csv").write_text("\n".join(("time_s,elapsed_ms,z_g", *rows, "")))
    found = import_csv_file(tmp_path / "a.csv", LABEL, axis="z")
    assert found.recording.rate_hz == pytest.approx(RATE_HZ)
    assert found.recording.samples.size == Z.size


def test_no_sample_is_taken_for_a_line_of_names(tmp_path: Path) -> None:
    head, first, *others = log("time_s,z_g,note\n", "{t},{z}").splitlines()
    (tmp_path / "a.csv").write_text("\n".join((head, f"{first},go", *others, "")))
    for named in ({}, {"time": "#1", "z": "#2"}):
        with refused(InputError, expected=["values", "line 2"], got=3):
            import_csv_file(tmp_path / "a.csv", LABEL, named=named, axis="z", unit="g")


def test_batches_whose_stamps_differ_are_no_recording(tmp_path: Path) -> None:
    stamps = np.floor(TIME_S * 100) / 100 + np.tile(np.arange(20), 20) * 1e-6
    rows = (f"{t:.6f},{z:.5f}" for t, z in zip(stamps.tolist(), Z.tolist(), strict=True))
    (tmp_path / "a.csv").write_text("\n".join(("time_s,z_g", *rows, "")))
    for rate_hz in (None, RATE_HZ):
        with refused(InputError, expected=["breaks", "a.csv"], got=["either", "or", "--rate"]):
            import_csv_file(tmp_path / "a.csv", LABEL, rate_hz=rate_hz)


def test_a_column_has_one_role(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(log("time_s,z_g\n", "{t},{z}"))
    with refused(InputError, expected="once", got=["time", "z"]):
        import_csv_file(tmp_path / "a.csv", LABEL, named={"time": "#1", "z": "time_s"})
