"""Files in a toolkit's layout: import, then model, as a user would."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from modeling import RecordingSet, TextureModel
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


def test_default_grid_leaves_out_what_lies_beyond(main, tmp_path: Path, files: list[str]) -> None:
    imported = main("import", "hatt", files[0], "--duration", 0.2, "--rate", 800, "--out", "set")
    assert imported.returncode == 0, imported.stderr
    # 350 mm/s is beyond the 300 of the file, at each of seven forces.
    (line,) = [line for line in imported.stdout.splitlines() if "left out" in line]
    assert "Canvas 9 (7)" in line
    records = RecordingSet.load(tmp_path / "set")
    assert len(records) == 42
    assert {r.rate_hz for r in records} == {800.0}
    assert max(r.speed_mm_s for r in records) == 300.0


def test_a_folder_stands_for_its_files(main, tmp_path: Path, files: list[str]) -> None:
    (tmp_path / "toolkit/deep").mkdir(parents=True)
    for name in files:
        (tmp_path / name).rename(tmp_path / "toolkit/deep" / name)
    (tmp_path / "toolkit/readme.xml").write_text("<other/>")
    imported = main("import", "hatt", "toolkit", "--duration", 0.2, "--out", "set")
    assert imported.returncode == 0, imported.stderr
    assert RecordingSet.load(tmp_path / "set").textures == ("Canvas 9", "MDF")
    (line,) = [line for line in imported.stdout.splitlines() if "left out" in line]
    assert "Canvas 9 (7)" in line
    assert "MDF (7)" in line
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
