"""Are results those of their data? Files against their hashes, then all of it made again."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

# What says where results come from, not what they are: paths and versions may differ.
_ORIGIN = ("provenance.json", "tables/provenance.tsv")
_PAGES = ("report.html", "supplement.html")


def verify_results(data: Path, results: Path) -> list[str]:
    """A line for each difference, beginning with "differs", and one that says what was compared.

    Parameters
    ----------
    data : Path
        What the results must be of.
    results : Path
        A folder that `tactileq analyze` wrote.

    Raises
    ------
    InputError
        If there are no results of analyze, or they are of other data.
    """
    from modeling import InputError
    from modeling.files.documents import read_json_object
    from modeling.files.hashes import sha256_of_file
    from modeling.files.provenance import PROVENANCE_NAME

    note = read_json_object(results / PROVENANCE_NAME, advice="name a folder of results")
    if note.get("command") != "tactileq analyze":
        raise InputError(
            f"expected results of tactileq analyze in {results}, got those of "
            f"{note.get('command', 'another program')}; name the folder of an analysis."
        )
    _require_data(note, data, results)
    stated: Mapping[str, str] = note.get("sha256", {})
    there = {
        path.relative_to(results).as_posix(): path
        for path in sorted(results.rglob("*"))
        if path.is_file() and path.name != PROVENANCE_NAME
    }
    lines = [
        f"differs: {results / name}: expected the file that was written, got "
        f"{'another' if name in there and name in stated else 'none' if name in stated else 'one'}"
        for name in sorted({*stated, *there})
        if name not in there or stated.get(name) != sha256_of_file(there[name])
    ]
    again = list(_again(data, there, note))
    return [*lines, *again] or [f"results verified: {len(there)} files, made again with the same"]


def _require_data(note: Mapping[str, Any], data: Path, results: Path) -> None:
    """Refuse results of other data."""
    from modeling import InputError
    from modeling.files.hashes import sha256_of_paths

    (now,) = sha256_of_paths([data]).values()
    stated = note.get("inputs_sha256", {})
    if now not in stated.values():
        raise InputError(
            f"expected results of the data in {data}, got in {results} those of other data, or of "
            "these before they were changed; analyze them again, or name the data's own results."
        )


def _again(data: Path, there: Mapping[str, Path], note: Mapping[str, Any]) -> Iterator[str]:
    """What differs when the analysis is made again with the same options."""
    from tactileq.commands.analyze import analyze

    options = dict(note.get("options", {}))
    folders = ("recordings", "models", "simplified", "plan")
    lost = [
        options[name] for name in folders if options.get(name) and not Path(options[name]).exists()
    ]
    if "options" not in note or lost:
        yield f"not made again: {lost[0] + ' is not here' if lost else 'an earlier version wrote it'}"
        return
    options |= {name: Path(options[name]) for name in folders if options.get(name)}
    options["data"] = [str(data)]
    with tempfile.TemporaryDirectory() as folder:
        fresh = Path(folder) / "again"
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            analyze(**options, out=fresh)
        for name, path in there.items():
            made = fresh / name
            if name in _ORIGIN or name in _PAGES:
                continue
            if not made.is_file():
                yield f"differs: {path}: expected no such file from an analysis made again, got one"
            elif made.read_bytes() != path.read_bytes():
                yield f"differs: {path}: expected what an analysis made again gives, got another"
        for made in sorted(fresh.rglob("*")):
            name = made.relative_to(fresh).as_posix()
            if made.is_file() and name not in there and name not in _ORIGIN:
                yield f"differs: {name}: expected the file that an analysis gives, got none"
