"""The manifest: reads back equal, says what ran, refuses what it is not."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from tactileq.experiments.sessions.kept import program
from tactileq.experiments.sessions.kept.data_set import require_rule
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tests.refusals import refused

ManifestOf = Callable[..., SessionManifest]


def test_it_loads_back_equal(tmp_path: Path, manifest_of: ManifestOf) -> None:
    made = manifest_of(
        code="たき",
        overrides=[{"what": "study", "reason": "lamp"}],
        identical={"canvas": [["full", "simplified"]]},
    )
    path = tmp_path / "manifest.json"
    path.write_text(made.to_json(), encoding="utf-8")
    loaded = SessionManifest.load(path)
    assert loaded.values == made.values
    assert loaded.to_json() == path.read_text(encoding="utf-8")
    assert loaded.sha256 == made.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert loaded.rig["latency_s"] == 0.1 + 0.2
    assert loaded.trials[4]["trial"] == 5


def test_values_that_json_does_not_know_are_plain(manifest_of: ManifestOf) -> None:
    made = manifest_of(rig={"gain": np.float64(2.5), "limit": float("inf"), "pins": (1, 2)})
    assert json.loads(made.to_json())["rig"] == {"gain": 2.5, "limit": None, "pins": [1, 2]}


def test_it_names_versions_lock_and_platform(manifest_of: ManifestOf) -> None:
    values = json.loads(manifest_of().to_json())
    packages = ["numpy", "scipy", "pandas"] + ["psychopy"] * (find_spec("psychopy") is not None)
    for package in packages:
        assert values["versions"][package] == version(package)
    lock = Path(__file__).parents[4] / "requirements.lock"
    assert values["lock_sha256"] == hashlib.sha256(lock.read_bytes()).hexdigest()
    assert values["platform"]
    assert values["versions"]["python"].startswith("3.")


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository of its own in which the program seems to lie."""
    file = tmp_path / "a" / "b" / "program.py"
    file.parent.mkdir(parents=True)
    file.write_text("as committed")
    for command in (
        ["init", "-q"],
        ["add", "."],
        ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "first"],
    ):
        subprocess.run(["git", *command], cwd=tmp_path, check=True)
    monkeypatch.setattr(program, "_HERE", file)
    program.program_facts.cache_clear()
    yield tmp_path
    program.program_facts.cache_clear()


def test_the_revision_and_whether_files_differ_from_it(repository: Path) -> None:
    told = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=repository, check=True, capture_output=True, text=True
    )
    facts = program.program_facts()
    assert (facts["git_revision"], facts["git_uncommitted"]) == (told.stdout.strip(), False)
    (repository / "a" / "b" / "program.py").write_text("changed")
    program.program_facts.cache_clear()
    facts = program.program_facts()
    assert (facts["git_revision"], facts["git_uncommitted"]) == (told.stdout.strip(), True)


def test_a_repository_that_does_not_know_the_program_says_nothing(
    repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed = repository / "a" / "site-packages.py"
    installed.write_text("installed here")
    monkeypatch.setattr(program, "_HERE", installed)
    facts = program.program_facts()
    assert (facts["git_revision"], facts["git_uncommitted"]) == ("", None)


def test_without_git_nothing_is_said(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(repository))
    assert program.program_facts()["git_revision"] == ""


def test_a_study_of_another_hash_is_refused(manifest_of: ManifestOf) -> None:
    with refused(InputError, names="study_sha256", got="'ff'"):
        manifest_of(study_sha256="ff")


@pytest.mark.parametrize("trial", [{"trial": 2, "phase": "main"}, {"trial": 1}])
def test_trials_are_numbered_and_have_a_phase(
    manifest_of: ManifestOf, trial: dict[str, object]
) -> None:
    with refused(InputError, expected=["trials", "number", "phase"]):
        manifest_of(trials=[trial])


def test_a_rule_that_was_withdrawn_begins_no_data_set_and_goes_on_in_one(tmp_path: Path) -> None:
    study = Study.load()
    old = replace(study, plan=replace(study.plan, rule="model"))
    require_rule(tmp_path, study)
    with refused(InputError, expected=["hierarchical", "tests"], got="model"):
        require_rule(tmp_path, old)
    assert not list(tmp_path.iterdir())
    (tmp_path / "dataset_description.json").write_text("{}")
    require_rule(tmp_path, old)
