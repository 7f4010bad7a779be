"""The scene that a model was compiled for, as stored in the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.kinds import Name


@dataclass(frozen=True)
class CompiledFor(FileSection):
    """The scene of a compiled model, and what is kept in it."""

    WHERE = "compiled_for"
    ADVICE = "compile the scene again"

    scene: Annotated[Name, key("its name")]
    scene_sha256: Annotated[str, key("of the scene's values")]
    full_sha256: Annotated[str, key("of the model that this one was compiled from")]
    bound: Annotated[
        Mapping[str, float],
        key("as in the scene: gfc30, bands_db, level_db", as_given=True),
    ] = field(hash=False)
    update_s: Annotated[
        float,
        key(
            "from one parameter update to the next: what a renderer takes by default",
            unit="s",
            gt=0,
            as_given=True,
        ),
    ]
    single: Annotated[bool, key("whether single precision keeps the bound, too")]
