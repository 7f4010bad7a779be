"""Bad input ends with one sentence and an exit code, and nothing is written."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import check_refusal, refused

NOISE = np.random.default_rng(3).normal(0, 0.1, 3000)
SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
LABELS = ("--speed", "1", "--force", "1")


def make_set(folder: Path, damage: Callable[[Path], object]) -> None:
    RecordingSet(
        Recording(NOISE, 5000.0, speed, force, "oak") for speed in (50, 100) for force in (1, 2)
    ).save(folder)
    damage(folder)


def edit(name: str, old: str, new: str) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return change


def fill(name: str, lines: list[str]) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text("\n".join(["acceleration_g", *lines, ""]))


def truncate(folder: Path) -> None:
    data = (folder / "0002.csv").read_bytes()
    (folder / "0002.csv").write_bytes(data[:-7])


def cut_at_a_line(folder: Path) -> None:
    lines = (folder / "0002.csv").read_text().splitlines(keepends=True)
    (folder / "0002.csv").write_text("".join(lines[:-500]))


DAMAGES = {
    "empty": (lambda f: (f / "0002.csv").write_text(""), "got an empty file"),
    "truncated": (truncate, "the file is truncated"),
    "cut": (cut_at_a_line, "expected 3000 samples in 0002.csv, got 2500"),
    "nan": (fill("0002.csv", ["0.1", "nan"] * 50), "expected finite samples"),
    "inf": (fill("0002.csv", ["0.1", "-inf"] * 50), "expected finite samples"),
    "constant": (fill("0002.csv", ["0.25"] * 100), "got the constant value 0.25"),
    "unit": (edit("recordings.tsv", "\tg\t", "\tfurlong\t"), "got 'furlong'"),
    "rate": (edit("recordings.tsv", "\t5000.0\t", "\t\t"), "column rate_hz, row 0001.csv"),
    "missing file": (lambda f: (f / "0003.csv").unlink(), "got nothing there"),
    "text": (fill("0002.csv", ["0.1", "o.2"] * 50), "one number per line"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_recording_is_named_and_left_out(main, tmp_path: Path, name: str) -> None:
    damage, sentence = DAMAGES[name]
    make_set(tmp_path / "set", damage)
    done = main("model", "set", "--out", "models")
    assert done.returncode == 0, done.stderr
    (warning,) = [line for line in done.stderr.splitlines() if "left out" in line]
    assert warning.startswith("warning: oak: left out: ")
    assert sentence in warning
    assert "oak: interpolated, because there is no recording: " in done.stdout
    model = json.loads((tmp_path / "models/oak.json").read_text())
    assert np.sum(model["interpolated"]) == 1
    provenance = json.loads((tmp_path / "models/oak_provenance.json").read_text())
    assert [sentence in told for told in provenance["settings"]["left_out"]] == [True]


@pytest.mark.parametrize("silence", ["0", "0.25"])
def test_a_silent_recording_is_named_and_left_out(main, tmp_path: Path, silence: str) -> None:
    make_set(tmp_path / "set", fill("0002.csv", [silence] * 3000))
    done = main("model", "set", "--out", "models")
    assert done.returncode == 0, done.stderr
    assert "left out" in done.stderr
    assert "oak: interpolated, because there is no recording: 50 mm/s at 2 N" in done.stdout


def test_recordings_that_are_all_damaged_are_refused(main, tmp_path: Path) -> None:
    def damage(folder: Path) -> None:
        for number in range(1, 5):
            (folder / f"{number:04d}.csv").write_text("")

    make_set(tmp_path / "set", damage)
    assert_refused(main("model", "set", "--out", "models"), expected="set/0001.csv", got="empty")
    assert not (tmp_path / "models").exists()


def test_one_condition_twice_is_refused(main, tmp_path: Path) -> None:
    """One of the labels is wrong, nobody knows which."""
    make_set(tmp_path / "set", edit("recordings.tsv", "50.0\t2.0", "50.0\t1.0"))
    done = main("model", "set", "--out", "models")
    assert_refused(done, expected="condition", got=["oak", "50 mm/s", "1 N", "'repeat'"])
    assert not (tmp_path / "models").exists()


def assert_refused(result, *, names: object = (), expected: object = (), got: object = ()) -> None:
    assert result.returncode != 0
    check_refusal(result.stderr, names=names, expected=expected, got=got)
    assert result.stderr.count("\n") == 1, result.stderr
    assert "Traceback" not in result.stderr
    assert result.stderr.startswith("error: ")


def test_a_folder_that_is_not_one(main, tmp_path: Path) -> None:
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes/a.txt").write_text("hello")
    assert_refused(main("model", "nowhere"), expected="folder", got=["nowhere", "recordings.tsv"])
    assert_refused(main("model", "notes"), expected=["recordings.tsv", "WAV", "notes"])
    assert_refused(main("model", "notes/a.txt"), expected="folder", got="notes/a.txt")
    assert_refused(main("analyze", "notes"), expected="study", got="notes")
    assert not (tmp_path / "models").exists()


def test_a_model_of_a_newer_version(main, tmp_path: Path) -> None:
    path = tmp_path / "new.json"
    planted_texture("canvas").save(path)
    values = json.loads(path.read_text())
    values["version"] = 2
    path.write_text(json.dumps(values))
    for command in (["simplify", "new.json"], ["stimuli", "new.json"]):
        assert_refused(main(*command), names="new.json", expected="version 1", got="version 2")
    path.write_text("{")
    assert_refused(main("simplify", "new.json"), expected=["JSON", "new.json"], got="line 1")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new.json"]


def test_options_without_meaning(main, tmp_path: Path) -> None:
    planted_texture("canvas").save(tmp_path / "m.json")
    for command, expected, got in (
        ("simplify m.json --margin-db -1", ["margin", "0 dB"], -1.0),
        ("simplify m.json --threshold tongue", ["codec", "pen-hold", "mobile", "TSV"], "'tongue'"),
        ("simplify m.json --threshold my.tsv", "my.tsv", "nothing"),
        ("stimuli m.json --rate 1000", ["5000 Hz", "canvas"], "1000 Hz"),
        ("stimuli m.json --duration 0", ["duration_s", 3600], 0.0),
        ("record new --texture silk", ["texture", "canvas"], "'silk'"),
        ("record new --texture canvas --duration -1", ["duration", "0 s"], -1.0),
        ("import wav a.wav", ["speed", "force"], ["--speed", "--force", "--labels"]),
        ("import wav a.wav --speed 1 --force 1", ["WAV", "a.wav"], "nothing"),
    ):
        assert_refused(main(*command.split()), expected=expected, got=got)
    assert [p.name for p in tmp_path.iterdir()] == ["m.json"]


def test_results_do_not_overwrite_foreign_folders(main, tmp_path: Path) -> None:
    planted_texture("canvas").save(tmp_path / "m.json")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.txt").write_text("years of work")
    for command in (
        ["stimuli", "m.json", "--out", "mine"],
        ["record", "mine", "--texture", "canvas"],
        ["demo", "--out", "mine"],
    ):
        assert_refused(main(*command), names="mine")
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def threshold(level: str) -> str:
    return f"frequency_hz\tacceleration_g\n10\t{level}\n600\t{level}\n"


def link_to_itself(path: Path) -> None:
    path.symlink_to(path)


def link_to_zeros(path: Path) -> None:
    path.symlink_to("/dev/zero")


# How a place is filled, and what is then named; each hung, or ended in a traceback or in words
# of the system or a library, before.
PLACES = {
    "pipe": (os.mkfifo, "pipe"),
    "device": (link_to_zeros, "device"),
    "loop": (link_to_itself, "link"),
    "folder": (Path.mkdir, "folder"),
    "nothing": (lambda path: None, "nothing"),
}
READERS = {
    "m.json": ["simplify", "m.json"],
    "v.json": ["export", "c", "good.json", "--vibrator", "v.json"],
    "set.toml": ["stimuli", "set.toml"],
    "study.toml": ["simulate", "--study", "study.toml"],
    "scene.toml": ["scene", "scene.toml"],
    "t.tsv": ["simplify", "good.json", "--threshold", "t.tsv"],
    "labels.tsv": ["import", "wav", "a.wav", "--labels", "labels.tsv"],
    "a.wav": ["import", "wav", "a.wav", *LABELS],
    "test.wav": ["vibrator", "test.wav"],
    "run.csv": ["import", "csv", "run.csv", *LABELS],
    "M.xml": ["import", "hatt", "M.xml"],
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("place", PLACES)
def test_what_is_no_file_is_never_opened(main, tmp_path: Path, place: str, name: str) -> None:
    make, got = PLACES[place]
    if "good.json" in READERS[name]:
        planted_texture("canvas", **SMALL).save(tmp_path / "good.json")
    make(tmp_path / name)
    assert_refused(main(*READERS[name]), expected=name, got=got)
    assert {path.name for path in tmp_path.iterdir()} <= {name, "good.json"}


def test_links_in_a_circle_are_no_place(main, tmp_path: Path) -> None:
    planted_texture("canvas", **SMALL).save(tmp_path / "m.json")
    link_to_itself(tmp_path / "loop")
    link_to_itself(tmp_path / "loop.json")
    assert_refused(main("stimuli", "loop.json"), expected="loop.json", got="link")
    assert_refused(main("stimuli", "m.json", "--out", "loop"), got=["link", "loop"])
    assert_refused(main("simplify", "m.json", "--out", "loop/x"), names="loop")
    assert_refused(main("record", "loop/x", "--texture", "canvas"), names="loop")


CONTENTS = {
    "deep JSON": ("m.json", b"[" * 100_000, "JSON", "nested"),
    "deep scene": ("scene.toml", b"a = " + b"[" * 100_000, "TOML", "nested"),
    "deep TOML": ("set.toml", b"a = " + b"[" * 100_000, "TOML", "nested"),
    "JSON beyond numbers": ("m.json", b'{"a": ' + b"9" * 310 + b"}", "JSON", "number"),
    "JSON beyond digits": ("m.json", b'{"a": ' + b"9" * 5000 + b"}", "JSON", "number"),
    "TOML beyond numbers": ("study.toml", b"seed = " + b"9" * 310, "TOML", "number"),
    "TOML beyond digits": ("study.toml", b"seed = " + b"9" * 5000, "TOML", "number"),
    "half a character": ("m.json", b'{"texture": "\\ud800"}', "JSON", "Unicode"),
    "other letters": ("t.tsv", "é".encode("cp1252"), "table", "UTF-8"),
    "no sound": ("a.wav", b"\xff\xfb" * 2000, "WAV", "sound"),
    "open quote": (
        "run.csv",
        b'time,x\n0,"1\n' + b"0.1,2\n" * 90_000,
        ["quotes", "line 2"],
        "'0,\"1'",
    ),
    "long line": ("t.tsv", b"frequency_hz\n1\t" + b"9" * 5_000_000 + b"\n", "1 cell", 2),
    "long name": ("labels.tsv", b"x" * 5_000_000, ["file", "speed_mm_s", "force_n"], "…"),
    "no threshold": ("t.tsv", threshold("1e300").encode(), "1e+06 g", "'1e300'"),
}


@pytest.mark.parametrize("what", CONTENTS)
def test_hostile_contents_end_in_one_short_sentence(main, tmp_path: Path, what: str) -> None:
    name, data, expected, got = CONTENTS[what]
    planted_texture("canvas", **SMALL).save(tmp_path / "good.json")
    (tmp_path / name).write_bytes(data)
    plot = ["--plot"] if name == "t.tsv" else []
    done = main(*READERS[name], *plot)
    assert_refused(done, names=Path(name).stem, expected=expected, got=got)
    assert len(done.stderr) < 400


def test_a_byte_order_mark_is_read(main, tmp_path: Path) -> None:
    planted_texture("canvas").save(tmp_path / "plain.json")
    model = (tmp_path / "plain.json").read_bytes()
    recipe = b'version = 1\n[set]\nname = "marked"\n[[model]]\npath = "m.json"\n'
    recipe += b"[[trajectory]]\nspeed_mm_s = 100\nforce_n = 1\n"
    for name, data in (
        ("m.json", model),
        ("set.toml", recipe),
        ("t.tsv", threshold("0.1").encode()),
    ):
        (tmp_path / name).write_bytes(b"\xef\xbb\xbf" + data)
    for command in (["simplify", "m.json", "--threshold", "t.tsv"], ["stimuli", "set.toml"]):
        done = main(*command)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("command", "expected", "got"),
    [
        ("record new --texture canvas --rate 1e12", "10000000 Hz", 1e12),
        ("record new --texture canvas --duration 1e9", ["440.451 s", "22704 Hz"], "1e+09 s"),
        ("record new --texture canvas --duration inf", ["duration", "0 s"], "inf"),
        ("import csv run.csv --rate 1e12 --speed 1 --force 1", "10000000 Hz", 1e12),
        (
            "import csv run.csv --rate 5000 --speed 1e308 --force 1",
            ["speed_mm_s", 100000],
            "1e+308",
        ),
        ("import hatt M.xml --rate 1e-300", [1, "1000 Hz"], 1e-300),
        ("import hatt M.xml --duration 1e300", ["10000 s", "1000 Hz"], "1e+300 s"),
        ("stimuli m.json --rate 1e12", ["rate_hz", 1, "768000 Hz"], 1e12),
        ("export c m.json --rate 1e12", "768000 Hz", "1e+12"),
    ],
)
def test_numbers_beyond_sense(
    main,
    tmp_path: Path,
    hatt_xml: Callable[..., str],
    command: str,
    expected: object,
    got: object,
) -> None:
    planted_texture("canvas").save(tmp_path / "m.json")
    (tmp_path / "M.xml").write_text(hatt_xml())
    (tmp_path / "run.csv").write_text("x\n" + "".join(f"{x}\n" for x in NOISE[:100]))
    assert_refused(main(*command.split()), expected=expected, got=got)
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize("way", ["../loud.csv", "absolute"])
def test_a_set_names_no_file_outside_its_folder(tmp_path: Path, way: str) -> None:
    make_set(tmp_path / "set", lambda folder: (folder / "0002.csv").rename(tmp_path / "loud.csv"))
    named = {"absolute": str(tmp_path / "loud.csv")}.get(way, way)
    edit("recordings.tsv", "0002.csv", named)(tmp_path / "set")
    with refused(InputError, expected=[tmp_path / "set", "recordings.tsv"], got="loud.csv"):
        RecordingSet.load(tmp_path / "set")
