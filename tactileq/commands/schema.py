"""tactileq schema: the JSON Schema of a file, by which an editor completes and checks it."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated

import typer

from modeling.errors import InputError, shown

if TYPE_CHECKING:
    from modeling.files.described import FileSection

# Each kind of file, and where it is declared.
DECLARED = {
    "scene": "modeling.scenes.scene:SceneFile",
    "recipe": "stimuli.sets.recipe:Recipe",
    "study": "experiments.study.study:Study",
    "rig": "rig.setup.rig_file:RigFile",
    "recorder": "rig.recorder.recorder_file:RecorderFile",
    "model": "modeling.models.texture_model:TextureModel",
    "regressed-model": "modeling.models.regressed_model:RegressedModel",
    "ar-model": "modeling.models.ar_model:ARModel",
    "simplification": "modeling.perception.verdicts:Simplification",
    "vibrator": "modeling.vibrators.vibrator:Vibrator",
    "session": "experiments.sessions.manifest:SessionManifest",
}


def schema(
    name: Annotated[str, typer.Argument(help=f"A kind of file: {', '.join(DECLARED)}.")],
) -> None:
    """Print the JSON Schema of a kind of file, for editors that complete and check it.

    A TOML file names its schema in the first line, as a path relative to it: #:schema
    ./scene.schema.json

    Example: tactileq schema scene > scene.schema.json
    """
    from modeling.files.describing import schema_text

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
