"""What participants read, in files of the data set: one for all sessions with equal texts.

docs/method/protocols.md#languages
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.stored_sessions import StoredSession
from tactileq.modeling.files.described import naming
from tactileq.modeling.files.hashes import sha256_of
from tactileq.modeling.files.writing import write_text

TextsByLanguage = Mapping[str, Mapping[str, str]]  # each text by its key
_DIGITS = 16  # of the hash in a file's name


def sha256_of_texts(texts: TextsByLanguage) -> dict[str, str]:
    """SHA-256 of the file of each language."""
    return {language: sha256_of(_as_toml(of_one)) for language, of_one in texts.items()}


def texts_file(language: str, sha256: str) -> Path:
    """The file of these texts, relative to the data set."""
    return Path("sourcedata", f"texts_{language}_{sha256[:_DIGITS]}.toml")


def write_texts(root: Path, texts: TextsByLanguage) -> None:
    """Write the file of each language that is not there yet, forced to disk.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    for language, of_one in texts.items():
        content = _as_toml(of_one)
        path = root / texts_file(language, sha256_of(content))
        if not path.is_file() or path.read_bytes() != content.encode():
            write_text(path, content)


def texts_of_sessions(held: Iterable[StoredSession]) -> dict[Path, str]:
    """The files of all texts that sessions began or went on with, and the SHA-256 of each.

    Raises
    ------
    InputError
        For a log that states other things of them than hashes.
    """
    found: dict[Path, str] = {}
    for one in held:
        with naming(one.files.log):
            for stated in _stated(one):
                found |= {texts_file(name, sha256): sha256 for name, sha256 in stated.items()}
    return found


def _stated(one: StoredSession) -> Iterable[Mapping[str, str]]:
    yield one.manifest.texts_sha256 or {}
    for event in one.state.events:
        if event["event"] == "opened":
            changed = (event.get("changed") or {}).get("texts_sha256")
            yield SessionManifest.of_field("texts_sha256", changed) or {}


def _as_toml(texts: Mapping[str, str]) -> str:
    """A file that a study can name as it stands; equal texts give equal bytes.

    A text of JSON is one of TOML but for the character that JSON leaves as it is (U+007F).
    """
    lines = (
        f"{json.dumps(key, ensure_ascii=False)} = {json.dumps(text, ensure_ascii=False)}\n"
        for key, text in sorted(texts.items())
    )
    return "".join(lines).replace("\x7f", "\\u007f")
