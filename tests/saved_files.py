"""Files that programs save as JSON, one of each kind, and what reads them."""

from __future__ import annotations

import json
from pathlib import Path

from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.modeling.files.described_json import DescribedJson
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.regressed_model import RegressedModel
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.perception.verdicts import Simplification
from tactileq.modeling.vibrators.vibrator import Vibrator
from tests.described import Kind

SAVED = Path(__file__).parent / "data" / "saved"
READERS: tuple[type[DescribedJson], ...] = (
    *(TextureModel, RegressedModel, ARModel, Vibrator, Simplification, SessionManifest),
)


def reader(path: Path) -> type[DescribedJson]:
    """The class of the file's format."""
    stated = json.loads(path.read_text(encoding="utf-8"))["format"]
    return next(one for one in READERS if stated == one.FORMAT)


def _kind(path: Path) -> Kind:
    section = reader(path)
    return Kind(
        name=path.name,
        section=section,
        examples=(json.loads(path.read_text(encoding="utf-8")),),
        load=section.load,
        write=lambda values: json.dumps(values, indent=2),  # knows NaN, and a line for each key
        beside={},
        again=lambda loaded: loaded.to_json(),
    )


KINDS = tuple(_kind(path) for path in sorted(SAVED.glob("*.json")) if "plain" not in path.stem)
