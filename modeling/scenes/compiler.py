"""The cheapest model that keeps a scene's bound (docs/method/scenes.md).

Cheapest is what takes the fewest counted operations per sample; of equals the fewest bytes; of
those the fewest stored numbers. What is searched: which of the layers that are not felt are
dropped, the interval of parameter updates, single or double precision, and what drives the
parameters: some conditions of the grid or a regression.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from tactileq.modeling.errors import InputError
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.scenes.budgets import beyond_budget, within_budget
from tactileq.modeling.scenes.compiled import CompiledScene
from tactileq.modeling.scenes.results import compiled_texture
from tactileq.modeling.scenes.scene import Scene
from tactileq.modeling.scenes.search import ComputedModels, Search


def compile_scene(
    scene: Scene,
    models: Mapping[str, TextureModel],
    *,
    progress: Callable[[str], None] = lambda texture: None,
) -> CompiledScene:
    """The cheapest model of every texture of a scene that keeps the bound.

    Parameters
    ----------
    models : mapping of str to TextureModel
        Full models by the name of their texture, in g; those that the scene does not name are not
        used.
    progress : callable
        Called with the name of each texture when it is done.

    Raises
    ------
    InputError
        For a texture without a model; for a scene beyond the recorded grid; for a bound that the
        actuator's limits or a budget do not allow, with the closest that can be kept.
    """
    return compile_scenes([scene], models, progress=lambda scene, texture: progress(texture))[0]


def compile_scenes(
    scenes: Sequence[Scene],
    models: Mapping[str, TextureModel],
    *,
    progress: Callable[[Scene, str], None] = lambda scene, texture: None,
) -> list[CompiledScene]:
    """`compile_scene` of several scenes, which share what is known of the models' errors.

    Parameters and errors as there; `progress` is also called with the scene.
    """
    known = ComputedModels()
    return [_compiled(scene, models, known, progress=partial(progress, scene)) for scene in scenes]


def _compiled(
    scene: Scene,
    models: Mapping[str, TextureModel],
    known: ComputedModels,
    *,
    progress: Callable[[str], None],
) -> CompiledScene:
    names = scene.textures or tuple(models)
    _check_models(scene, names, models)
    searches = []
    for name in names:
        searches.append(Search(models[name], scene, known))
        searches[-1].cheapest(scene.bound)
        progress(name)
    chosen = within_budget(searches, scene, scene.bound)
    if chosen is None:
        raise InputError(beyond_budget(searches, scene))
    return CompiledScene(scene, tuple(map(compiled_texture, searches, chosen)))


def _check_models(scene: Scene, names: Sequence[str], models: Mapping[str, TextureModel]) -> None:
    missing = [name for name in names if name not in models]
    if missing or not names:
        raise InputError(
            f"expected a full model of each texture of the scene {scene.name}, got none of "
            f"{', '.join(missing) or 'any'}; model what is missing, or leave it out of the scene."
        )
    for name in names:
        if not isinstance(models[name], TextureModel):
            raise InputError(
                f"expected texture models over a grid for the scene {scene.name}, got another kind "
                f"for {name}; compile from what tactileq model made."
            )
