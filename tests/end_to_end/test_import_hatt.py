"""Files in a toolkit's layout: import, then model, as a user would."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tactileq.modeling import RecordingSet, TextureModel
from tests.refusals import check_refusal

Xml = Callable[..., str]
GRID = [*("--speed", 100, "--speed", 200, "--speed", 280), *("--force", 1, "--force", 3)]


@pytest.fixture
def files(tmp_path: Path, hatt_xml: Xml) -> list[str]:
    """Two textures of the toolkit's layout."""
    names = ["Models_Canvas 9.xml", "Models_MDF.xml"]
    for name in names:
        text = hatt_xml(material=name.removeprefix("Models_").removesuffix(".xml"))
        (tmp_path / name).write_text(text, encoding="utf-8")
    return names


def test_two_textures_become_recordings_and_models(main, tmp_path: Path, files: list[str]) -> None:
    imported = main("import", "hatt", *files, *GRID, "--out", "set", "--seed", 3)
    assert imported.returncode == 0, imported.stderr
    assert "12 recordings added at 1000 Hz, 12 in set" in imported.stdout
    assert "left out" not in imported.stdout
    records = RecordingSet.load(tmp_path / "set")
    assert records.textures == ("Canvas 9", "MDF")
    assert all(r.simulated and r.unit == "g" for r in records)
    provenance = json.loads((tmp_path / "set/provenance.json").read_text())
    assert provenance["command"] == "tactileq import hatt"
    assert provenance["settings"]["seed"] == 3
    assert set(provenance["inputs_sha256"]) == set(files)
    fitted = main("model", "set", "--out", "models")
    assert fitted.returncode == 0, fitted.stderr
    for name in ("Canvas-9", "MDF"):
        assert TextureModel.load(tmp_path / f"models/{name}.json").simulated
    again = main("import", "hatt", *files, *GRID, "--out", "again", "--seed", 3)
    assert again.returncode == 0
    assert RecordingSet.load(tmp_path / "again") == records


def test_default_grid_spans_the_range_of_each_file(
    main, tmp_path: Path, files: list[str], hatt_xml: Xml
) -> None:
    corner = hatt_xml(material="MDF", conditions=((100, 1), (300, 1), (100, 3)))
    (tmp_path / files[1]).write_text(corner, encoding="utf-8")
    imported = main("import", "hatt", *files, "--duration", 0.2, "--rate", 800, "--out", "set")
    assert imported.returncode == 0, imported.stderr
    # Its models with vibration are at 160 mm/s, 1.5 N and 300 mm/s, 4 N, within silent ones.
    canvas, mdf = (line_about(name, imported.stdout) for name in ("Canvas 9", "MDF"))
    for fact in ("7 speeds of 160 to 300 mm/s", "7 forces of 1.5 to 4 N", "49 of 49", "linear"):
        assert fact in canvas
    for fact in ("7 speeds of 100 to 300 mm/s", "7 forces of 1 to 3 N", "32 of 49"):
        assert fact in mdf
    assert "left out" in imported.stdout
    records = RecordingSet.load(tmp_path / "set")
    assert len(records.of_texture("Canvas 9")) == 49
    assert len(records.of_texture("MDF")) == 32
    assert {r.rate_hz for r in records} == {800.0}
    settings = json.loads((tmp_path / "set/provenance.json").read_text())["settings"]
    grid = settings["grids"]["MDF"]
    assert {r.speed_mm_s for r in records.of_texture("MDF")} == set(grid["speeds_mm_s"])
    assert {r.force_n for r in records.of_texture("MDF")} == set(grid["forces_n"])


def line_about(texture: str, output: str) -> str:
    (line,) = [line for line in output.splitlines() if line.startswith(f"{texture}: ")]
    return line


def test_a_grid_of_ones_own_counts_what_it_keeps(main, tmp_path: Path, files: list[str]) -> None:
    axes = ("--speed", 200, "--speed", 350, "--force", 1, "--force", 3)
    imported = main("import", "hatt", files[0], *axes, "--duration", 0.2, "--out", "set")
    assert imported.returncode == 0, imported.stderr
    # 350 mm/s is beyond the 300 of the file.
    assert "2 of 4 nodes" in line_about("Canvas 9", imported.stdout)
    conditions = [r.condition for r in RecordingSet.load(tmp_path / "set")]
    assert conditions == [(200, 1), (200, 3)]


def test_own_conditions_are_imported_as_they_are(main, tmp_path: Path, hatt_xml: Xml) -> None:
    scattered = [(37.123457, 2.25), (91.5, 0.123457), (160.25, 1.5), (212.0, 0.75)]
    text = hatt_xml(material="Felt", conditions=[(0, 0), (250, 0), (0, 3), *scattered])
    (tmp_path / "Models_Felt.xml").write_text(text, encoding="utf-8")
    words = ("Models_Felt.xml", "--own-conditions", "--duration", 0.2, "--seed", 7)
    imported = main("import", "hatt", *words, "--out", "set")
    assert imported.returncode == 0, imported.stderr
    told = line_about("Felt", imported.stdout)
    for fact in ("4 own conditions", "37.12 to 212 mm/s", "0.1235 to 2.25 N"):
        assert fact in told
    assert "left out" not in imported.stdout
    records = RecordingSet.load(tmp_path / "set")
    assert [r.condition for r in records] == scattered
    assert all(r.simulated and r.unit == "g" and r.texture == "Felt" for r in records)
    settings = json.loads((tmp_path / "set/provenance.json").read_text())["settings"]
    assert settings["own_conditions"] is True
    assert settings["grids"] == {}
    assert settings["seed"] == 7


@pytest.mark.parametrize("axis", [("--speed", 100), ("--force", 1)])
def test_own_conditions_and_a_grid_contradict_each_other(
    main, tmp_path: Path, files: list[str], axis: tuple[str, int]
) -> None:
    refused = main("import", "hatt", files[0], "--own-conditions", *axis, "--out", "set")
    assert refused.returncode == 1
    check_refusal(refused.stderr, expected=["--own-conditions", "--speed", "--force"], got="both")
    assert not (tmp_path / "set").exists()


NO_RANGE = {
    "one condition": (((0, 0), (200, 0), (0, 4), (100, 1)), "Flat", "two conditions", "100 mm/s"),
    "no vibration": (((0, 0), (200, 0), (0, 4)), "Flat", "vibration", "none"),
    "all alike": (((0, 0), (200, 0), (0, 4)), "Models_Flat.xml", "area", "lines"),
}


@pytest.mark.parametrize("what", NO_RANGE)
def test_files_without_a_range_are_refused_in_one_sentence(
    main, tmp_path: Path, files: list[str], hatt_xml: Xml, what: str
) -> None:
    conditions, name, expected, got = NO_RANGE[what]
    text = hatt_xml(material="Flat", conditions=conditions)
    if what == "all alike":
        text = re.sub("<value>(200|4|0).000000</value>", "<value>100.000000</value>", text)
        text = re.sub("<(speed|force)Mod>.*?<", r"<\1Mod>100.000000<", text)
    (tmp_path / "Models_Flat.xml").write_text(text, encoding="utf-8")
    refused = main("import", "hatt", files[0], "Models_Flat.xml", "--out", "set")
    assert refused.returncode == 1
    check_refusal(refused.stderr, names=name, expected=expected, got=got)
    assert len(refused.stderr.splitlines()) == 1
    assert not (tmp_path / "set").exists()


def test_two_files_of_one_texture_are_not_mixed(
    main, tmp_path: Path, files: list[str], hatt_xml: Xml
) -> None:
    """Their grids may differ now, so that no condition would come twice."""
    other = hatt_xml(material="Canvas 9", conditions=((100, 1), (300, 1), (100, 3)))
    (tmp_path / files[1]).write_text(other, encoding="utf-8")
    refused = main("import", "hatt", *files, "--duration", 0.2, "--out", "set")
    assert refused.returncode == 1
    check_refusal(refused.stderr, expected="texture", got=[*files, "'Canvas 9'"])
    assert not (tmp_path / "set").exists()


def test_many_files_are_summed_up(main, tmp_path: Path, hatt_xml: Xml) -> None:
    for number in range(7):
        text = hatt_xml(material=f"M{number}", conditions=((100, 1), (300, 1), (100, 3)))
        (tmp_path / f"Models_M{number}.xml").write_text(text, encoding="utf-8")
    imported = main("import", "hatt", ".", "--duration", 0.1, "--out", "set")
    assert imported.returncode == 0, imported.stderr
    assert "32 of 49 nodes" in line_about("M4", imported.stdout)
    assert "M5: " not in imported.stdout
    assert "64 of 98 nodes" in line_about("2 more textures", imported.stdout)


def test_a_folder_stands_for_its_files(main, tmp_path: Path, files: list[str]) -> None:
    (tmp_path / "toolkit/deep").mkdir(parents=True)
    for name in files:
        (tmp_path / name).rename(tmp_path / "toolkit/deep" / name)
    (tmp_path / "toolkit/readme.xml").write_text("<other/>")
    imported = main("import", "hatt", "toolkit", "--duration", 0.2, "--out", "set")
    assert imported.returncode == 0, imported.stderr
    assert RecordingSet.load(tmp_path / "set").textures == ("Canvas 9", "MDF")
    assert "49 of 49" in line_about("Canvas 9", imported.stdout)
    assert "49 of 49" in line_about("MDF", imported.stdout)
    assert "left out" not in imported.stdout
    (tmp_path / "empty").mkdir()
    refused = main("import", "hatt", "empty", "--out", "set")
    assert refused.returncode == 1
    check_refusal(refused.stderr, expected=["Models_….xml", "empty"], got="none")


def test_broken_file_is_named_and_nothing_is_written(
    main, tmp_path: Path, files: list[str], hatt_xml: Xml
) -> None:
    (tmp_path / files[1]).write_text(hatt_xml().replace("<var>", "<var>-"), encoding="utf-8")
    refused = main("import", "hatt", *files, "--out", "set")
    assert refused.returncode == 1
    assert "expected a var of at least 0 in Models_MDF.xml" in refused.stderr
    assert "Traceback" not in refused.stderr
    assert not (tmp_path / "set").exists()
