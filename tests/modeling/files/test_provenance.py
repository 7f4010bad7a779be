"""What results came from."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

import pytest

from tactileq.modeling.files.provenance import NOT_INSTALLED, provenance_of


def test_what_is_not_installed_is_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_psychopy(name: str) -> str:
        if name == "psychopy":
            raise PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr("tactileq.modeling.files.provenance.version", without_psychopy)
    versions = provenance_of("model", {})["versions"]
    assert versions["psychopy"] == NOT_INSTALLED
    assert versions["numpy"] == version("numpy")
