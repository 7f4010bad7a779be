"""Models of any kind from files and folders."""

from __future__ import annotations

import json
from pathlib import Path

from modeling.errors import InputError
from modeling.models.ar_model import ARModel
from modeling.models.regressed_model import RegressedModel
from modeling.models.texture_model import TextureModel

AnyModel = TextureModel | RegressedModel | ARModel
_KINDS: dict[str, type[AnyModel]] = {
    kind.FORMAT: kind for kind in (TextureModel, RegressedModel, ARModel)
}


def load_model(path: Path) -> AnyModel:
    """A saved model of any kind, by the format that the file states."""
    # Where it states none, `TextureModel.load` says what is wrong with the file.
    return _KINDS.get(_stated_format(path) or "", TextureModel).load(path)


def is_something_else(path: Path) -> bool:
    """Whether a JSON file states that it holds no model but, say, a vibrator.

    False of a file that states nothing: that may be a damaged model.
    """
    stated = _stated_format(path)
    return stated is not None and stated not in _KINDS


def model_files(folder: Path) -> list[Path]:
    """JSON files of a folder that may be models, in order of name; provenance is none.

    Raises
    ------
    InputError
        Where all of them state that they are something else.
    """
    found = sorted(p for p in folder.glob("*.json") if not p.name.endswith("provenance.json"))
    if all(map(is_something_else, found)):
        raise InputError(f"expected model files in {folder}, got none; fit or simplify some first.")
    return found


def load_models(folder: Path) -> dict[str, TextureModel]:
    """All models of a folder by the name of their texture.

    Raises
    ------
    InputError
        For a folder without models, a file that is none, and two models of one texture.
    """
    models: dict[str, TextureModel] = {}
    for path in model_files(folder):
        if is_something_else(path):
            continue
        fitted = TextureModel.load(path)
        if fitted.texture in models:
            raise InputError(
                f"expected one model of each texture in {folder}, got two of {fitted.texture!r}; "
                f"move {path.name} or the other one away."
            )
        models[fitted.texture] = fitted
    return models


def _stated_format(path: Path) -> str | None:
    try:
        stated = json.loads(path.read_text(encoding="utf-8")).get("format")
    except (OSError, ValueError, AttributeError):
        return None
    return stated if isinstance(stated, str) else None
