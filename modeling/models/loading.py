"""Models of any kind from files and folders."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.places import matching
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.regressed_model import RegressedModel
from tactileq.modeling.models.texture_model import TextureModel

Layered = TextureModel | RegressedModel
AnyModel = Layered | ARModel
Model = TypeVar("Model", bound=AnyModel)
_KINDS: dict[str, type[AnyModel]] = {
    kind.FORMAT: kind for kind in (TextureModel, RegressedModel, ARModel)
}
# Files beside models that describe them.
_ABOUT_MODELS = ("tactileq.simplification", "tactileq.compiled-scene")


def made_from(model: AnyModel) -> frozenset[str]:
    """SHA-256 of the models that a model says it was simplified or compiled from."""
    note = getattr(model, "compiled_for", None)
    stated = {getattr(model, "simplified_from", ""), note.full_sha256 if note else ""}
    return frozenset(stated - {""})


def load_model(path: Path) -> AnyModel:
    """A saved model of any kind, by the format that the file states."""
    # Where it states none, `TextureModel.load` says what is wrong with the file.
    return _KINDS.get(_stated_format(path) or "", TextureModel).load(path)


def models_among(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Which of these JSON files may be models, and which state that they are something else.

    A file that states nothing may be a damaged model. Provenance, simplifications and what
    describes a compiled scene are neither.
    """
    models: list[Path] = []
    others: list[Path] = []
    for path in paths:
        stated = _stated_format(path)
        if stated not in _ABOUT_MODELS and not path.name.endswith("provenance.json"):
            (models if stated is None or stated in _KINDS else others).append(path)
    return models, others


def models_in(folder: Path) -> tuple[list[Path], list[Path]]:
    """`models_among` the JSON files of a folder, in order of name.

    Raises
    ------
    InputError
        If none may be a model.
    """
    models, others = models_among(matching(folder, "*.json"))
    if not models:
        raise InputError(f"expected model files in {folder}, got none; fit or simplify some first.")
    return models, others


def load_models(folder: Path) -> dict[str, TextureModel]:
    """All models of a folder by the name of their texture; each has to be a `TextureModel`.

    Raises
    ------
    InputError
        For a folder without models, a file that is none, and two models of one texture.
    """
    return _by_texture(folder, TextureModel.load)


def load_any_models(folder: Path) -> dict[str, AnyModel]:
    """All models of a folder by the name of their texture, of any kind.

    Raises
    ------
    InputError
        For a folder without models, a file that is none, and two models of one texture.
    """
    return _by_texture(folder, load_model)


def _by_texture(folder: Path, load: Callable[[Path], Model]) -> dict[str, Model]:
    models: dict[str, Model] = {}
    for path in models_in(folder)[0]:
        fitted = load(path)
        if fitted.texture in models:
            raise InputError(
                f"expected one model of each texture in {folder}, got two of "
                f"{shown(fitted.texture)}; move {path.name} or the other one away."
            )
        models[fitted.texture] = fitted
    return models


def _stated_format(path: Path) -> str | None:
    try:
        stated = read_json_object(path, advice="fit it again").get("format")
    except InputError:
        return None
    return stated if isinstance(stated, str) else None
