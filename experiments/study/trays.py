"""Whether the labels of trays reveal what is in them; asked before a study runs.

Not where a study is read: data that are stored under such labels stay readable.
"""

from __future__ import annotations

import re
import unicodedata

from tactileq.experiments.study.models import Allow, refuse
from tactileq.experiments.study.study import Study
from tactileq.modeling.errors import shown


def require_trays(study: Study, *, allow: Allow = refuse) -> None:
    """Refuse a label in which the name of a texture stands, its own or another one's.

    Parameters
    ----------
    allow : callable
        Called with what may be overridden ("telling trays") and the error against it.

    Raises
    ------
    InputError
        Naming texture and label.
    """
    for texture, label in study.trays.items():
        named = [name for name in study.textures if _names(label, name)]
        if named:
            allow(
                "telling trays",
                f"expected a label that reveals nothing to participants for the tray of "
                f"{shown(texture)}, got {shown(label)}, in which the texture {shown(named[0])} is "
                "named; label it as A, B, … under [trays]",
            )


def _names(label: str, texture: str) -> bool:
    """Whether it is the texture's name, however that is spaced, or has it among its words."""
    said, name = _words(label), _words(texture)
    return f" {name} " in f" {said} " or name.replace(" ", "") == said.replace(" ", "")


def _words(text: str) -> str:
    """Its words, whatever their letters' case and width and what stands between them."""
    plain = unicodedata.normalize("NFKC", text).casefold()
    return " ".join(re.findall(r"[^\W_]+", plain)) or text
