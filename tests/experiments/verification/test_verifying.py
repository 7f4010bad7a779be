"""Verification of data: what is tampered with is found, and nothing in what is not."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.study.models import ModelSets
from experiments.verification.verifying import verify_data
from tests.experiments.verification.small_studies import run_all, small_study
from tests.experiments.verification.tampering import SHOWN, STORED

Kind = Callable[[Path], None]


@pytest.fixture(scope="module")
def finished(models: ModelSets, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Data of a study that has ended."""
    root = tmp_path_factory.mktemp("study") / "data"
    run_all(root, small_study(("canvas", "PVC")), models)
    return root


@pytest.fixture
def copied(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "data"))


def test_nothing_differs_in_a_finished_study(finished: Path) -> None:
    found = verify_data(finished)
    assert found.findings == ()
    assert len(found.sessions) == 4
    assert len(found.seal) == 8
    assert found.unsealed == ()


@pytest.mark.parametrize("kind", [*STORED, *SHOWN])
def test_tampering_is_found(kind: str, copied: Path) -> None:
    {**STORED, **SHOWN}[kind](copied)
    assert verify_data(copied).findings
