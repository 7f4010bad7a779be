"""tactileq schema: the JSON Schema of a file, by which an editor completes and checks it."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.modeling.errors import InputError, shown

if TYPE_CHECKING:
    from tactileq.modeling.files.described import FileSection

# Each kind of file, and where it is declared.
DECLARED = {
    "scene": "tactileq.modeling.scenes.scene:SceneFile",
    "recipe": "tactileq.stimuli.sets.recipe:Recipe",
    "study": "tactileq.experiments.study.study:Study",
    "rig": "tactileq.rig.shared.setup.rig_file:RigFile",
    "recorder": "tactileq.rig.machines.recorder.recorder_file:RecorderFile",
    "model": "tactileq.modeling.models.texture_model:TextureModel",
    "regressed-model": "tactileq.modeling.models.regressed_model:RegressedModel",
    "ar-model": "tactileq.modeling.models.ar_model:ARModel",
    "simplification": "tactileq.modeling.perception.verdicts:Simplification",
    "vibrator": "tactileq.modeling.vibrators.vibrator:Vibrator",
    "session": "tactileq.experiments.sessions.kept.manifest:SessionManifest",
}


def schema(
    name: Annotated[str, typer.Argument(help=f"A kind of file: {', '.join(DECLARED)}.")],
) -> None:
    """Print the JSON Schema of a kind of file, for editors that complete and check it.

    A TOML file names its schema in the first line, as a path relative to it: #:schema
    ./scene.schema.json

    Example: tactileq schema scene > scene.schema.json
    """
    from tactileq.modeling.files.describing import schema_text

    print(schema_text(declared(name)), end="")


def declared(name: str) -> type[FileSection]:
    """The declaration of a kind of file; InputError for any other."""
    if name not in DECLARED:
        raise InputError(
            f"expected a kind of file among {', '.join(DECLARED)}, got {shown(name)}; choose one."
        )
    module, declaration = DECLARED[name].split(":")
    found: type[FileSection] = getattr(import_module(module), declaration)
    return found
