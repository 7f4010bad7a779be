"""The models of a scene, from its file or from the folder that it was compiled into."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from tactileq.modeling.errors import InputError, shortened
from tactileq.modeling.models.loading import Layered, load_models
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.scenes.compiled import load_compiled
from tactileq.modeling.scenes.compiler import compile_scene
from tactileq.modeling.scenes.scene import Scene


def full_models(
    scene: Scene, folder: str | Path | None = None
) -> tuple[Path, dict[str, TextureModel]]:
    """The folder of a scene's full models, and the models in it by the name of their texture.

    Parameters
    ----------
    folder : path, optional
        By default the one that the scene names.

    Raises
    ------
    InputError
        If there is no such folder, or it holds no models or two of one texture.
    """
    named = scene.models if folder is None else Path(folder)
    if named is None or not os.path.isdir(named):
        place = "" if named is None else f" at {shortened(str(named), longest=200)}"
        raise InputError(
            f"expected a folder of full models for the scene {scene.name}, got none{place}; name "
            "it as models under [scene], or with tactileq scene --models."
        )
    return named, load_models(named)


def scene_models(
    path: str | Path,
    full: Mapping[str, TextureModel] | None = None,
    *,
    progress: Callable[[float, str], None] = lambda share, texture: None,
) -> dict[str, Layered]:
    """The compiled models of a scene by the name of their texture.

    Parameters
    ----------
    path : path
        A scene file, which is compiled; or a folder that `tactileq scene` wrote.
    full : mapping, optional
        The full models of today; without them a scene file is compiled from the models that it
        names, and a folder is taken as it is.
    progress : callable
        Called with the share that is done and the texture that was done last.

    Raises
    ------
    InputError
        For what `Scene.load`, `full_models`, `compile_scene` or `load_compiled` refuse: models that
        have changed since among it.
    """
    if os.path.isdir(path):
        models = load_compiled(path, full)
        progress(1.0, "")
        return models
    scene = Scene.load(path)
    known = full_models(scene)[1] if full is None else full
    done: list[str] = []

    def warn(texture: str) -> None:
        done.append(texture)
        progress(len(done) / len(scene.textures or known), texture)

    return compile_scene(scene, known, progress=warn).models


def scene_files(path: str | Path, *, with_models: bool = False) -> tuple[Path, ...]:
    """What `scene_models` reads: a scene file and what it names, or a folder.

    Parameters
    ----------
    with_models : bool
        Also the full models that a scene file names, which are read where none are given.

    Raises
    ------
    InputError
        For what is no scene.
    """
    if os.path.isdir(path):
        return (Path(path),)
    scene = Scene.load(path)
    return scene.files if scene.models is None or not with_models else (*scene.files, scene.models)


def scene_name(path: str | Path) -> str:
    """What the scene of a scene file, or of the folder of a compiled one, is called.

    Raises
    ------
    InputError
        For what is neither.
    """
    if not os.path.isdir(path):
        return Scene.load(path).name
    notes = (model.compiled_for for model in load_compiled(path).values())
    return next((note.scene for note in notes if note), Path(path).name)
