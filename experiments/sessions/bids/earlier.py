"""Tables as an earlier version of the program made them: the same values, described otherwise.

docs/method/verification.md#earlier-versions
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.bids.tables import json_bytes
from tactileq.modeling.files.hashes import sha256_of_file

# A cell that had ' before it, in quotes or not, as in CSV.
_GUARDED = re.compile(rb"((?:^|\t)\"?)(?='*[=+@])", re.MULTILINE)
# To each text of this version those that stood in its place before. Whoever changes a text of a
# sidecar or of the README adds the one that it replaces.
_TEXTS = Path(__file__).with_name("earlier_texts.json")


def is_earlier(path: Path, made: bytes) -> bool:
    """Whether a file is what an earlier version made where this one makes `made`.

    Only texts that describe may differ, and only those of earlier versions, which are known. The
    cells of a table are the same, but for a ' that stood before what a spreadsheet would calculate:
    a column that came later is optional, and stored where a row has it.

    Parameters
    ----------
    path : Path
        A file that holds something else, or is not there.
    """
    try:
        there = path.read_bytes()
        if path.name == "README":
            return _same(there.decode().split("\n\n"), made.decode().split("\n\n"))
        if path.suffix == ".tsv":
            return _GUARDED.sub(rb"\1'", made) == there
        if path.suffix != ".json":
            return False
        values, wanted = json.loads(there), json.loads(made)
        if json_bytes(values) != there or not isinstance(values, dict):
            return False  # such as a key that stands there twice
        own = ("Files", "DerivedFrom") if "DerivedFrom" in wanted else ()
        rest = [{k: v for k, v in one.items() if k not in own} for one in (values, wanted)]
        of_files = not own or (
            _are_hashed(path, values["Files"], wanted["Files"])
            and _are_sources(path, values["DerivedFrom"], wanted["DerivedFrom"])
        )
        return of_files and _same(*rest)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def has_earlier_text(data: bytes) -> bool:
    """Whether a sidecar describes something in the words of an earlier version."""
    every = (text for texts in _earlier_texts().values() for text in texts)
    return any(json.dumps(text, ensure_ascii=False).encode() in data for text in every)


def _same(there: Any, made: Any) -> bool:
    """Whether values are the same but for texts of earlier versions."""
    if isinstance(there, dict) and isinstance(made, dict):
        return there.keys() == made.keys() and all(_same(there[k], made[k]) for k in made)
    if isinstance(there, list) and isinstance(made, list):
        return len(there) == len(made) and all(map(_same, there, made))
    return type(there) is type(made) and (there == made or there in _earlier_texts().get(made, ()))


def _are_hashed(sidecar: Path, stated: Mapping[str, str], wanted: Mapping[str, str]) -> bool:
    """Whether a sidecar lists the files that this version makes, with the hashes that they have."""
    return stated.keys() == wanted.keys() and all(
        sha256_of_file(sidecar.parent / name) == sha256 for name, sha256 in stated.items()
    )


def _are_sources(sidecar: Path, stated: Mapping[str, object], wanted: Mapping[str, object]) -> bool:
    """Whether a sidecar names its sources; of traces earlier versions stated the size alone."""
    folder = sidecar.parents[3] / "sourcedata" / sidecar.parts[-4] / sidecar.parts[-3]
    stem = sidecar.name.removesuffix("beh.json")
    traces = [name for name in wanted if name not in ("manifest", "log")]
    sizes = {f"{n}_bytes": (folder / f"{stem}{n}.tsv").stat().st_size for n in traces}
    hashed = {name: wanted[name] for name in ("manifest", "log")}
    return stated in (wanted, {**hashed, **sizes})


@cache
def _earlier_texts() -> Mapping[str, Sequence[str]]:
    texts: dict[str, list[str]] = json.loads(_TEXTS.read_text(encoding="utf-8"))
    return texts
