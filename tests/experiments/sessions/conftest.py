"""A small session, as its manifest plans it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from experiments.sessions.manifest import SessionManifest


def _manifest(**changed: Any) -> SessionManifest:
    phases = ["training", "training", "main", "main", "main", "main"]
    values: dict[str, Any] = {
        "task": "absolute",
        "subject": 1,
        "session": 1,
        "slot": 1,
        "code": "TAKI-46",
        "language": "en",
        "pilot": False,
        "simulated_participant": False,
        "simulated_rig": False,
        "study": {"name": "Small", "seed": 3, "data_license": "CC0"},
        "study_sha256": "aa",
        "plan_sha256": "bb",
        "models_sha256": {"canvas": {"full": "cc", "simplified": "dd"}},
        "model_sources": {"full": "models", "simplified": "simplified"},
        "identical": [],
        "rig": {"firmware": "1.2", "latency_s": 0.1 + 0.2},
        "description": "Compare a real and a virtual surface",
        "trials": [
            {"trial": n, "phase": phase, "texture": "canvas", "layout": ["MDF", "PVC"]}
            for n, phase in enumerate(phases, start=1)
        ],
    }
    return SessionManifest(**{**values, **changed})


@pytest.fixture
def manifest_of() -> Callable[..., SessionManifest]:
    """A manifest of two training and four main trials, with what is given changed."""
    return _manifest
