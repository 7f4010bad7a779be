"""Are models and results those of the data? By hashes; then the analysis is made again."""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tactileq.experiments.sessions.kept.manifest import SessionManifest

# What says where results come from, not what they are: paths and versions may differ.
_ORIGIN = ("tables/provenance.tsv",)
_PROVENANCE = re.compile(rb'id="table-provenance">.*?</table>', re.DOTALL)
_FOLDERS = ("recordings", "models", "simplified", "plan")
_WRITERS = ("tactileq analyze", "tactileq demo")


def verify_models(manifests: Sequence[SessionManifest]) -> tuple[list[str], str]:
    """Models and simplifications, where they lie, against the hashes that manifests hold.

    Scenes, which have to be compiled, are left out, and so are models that are not here any more.

    Returns
    -------
    list of str
        A sentence for each difference.
    str
        What was compared; empty where no manifest says where models were.

    Raises
    ------
    InputError
        If a file of models is none.
    """
    from tactileq.commands.results.verification import differing_models
    from tactileq.modeling.errors import counted

    of_place: dict[tuple[str, Path], list[SessionManifest]] = {}
    for one in manifests:
        for name, place in one.model_sources.items():
            of_place.setdefault((name, Path(place)), []).append(one)
    here = [key for key in sorted(of_place) if key[1].is_dir()]
    differs = [text for key in here for text in differing_models(*key, of_place[key])]
    if not of_place:
        return [], ""
    absent = ", ".join(str(place) for _, place in sorted(of_place.keys() - set(here)))
    said = f"models verified: {counted(len(here), 'set')} of {len(of_place)}"
    return differs, said + (f" (not here, or a scene: {absent})" if absent else "")


def verify_results(
    data: Path, results: Path, *, analyze: Callable[..., None]
) -> tuple[list[str], str]:
    """A folder of results against its hashes, and against an analysis that is made again.

    Parameters
    ----------
    data : Path
        What the results must be of.
    results : Path
        A folder that `tactileq analyze` wrote.
    analyze : callable
        That command, with its options by name.

    Returns
    -------
    list of str
        A sentence for each difference.
    str
        What was compared.

    Raises
    ------
    InputError
        If there are no results of analyze, or they are of other data.
    """
    from tactileq.modeling import InputError
    from tactileq.modeling.errors import counted
    from tactileq.modeling.files.documents import read_json_object
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    note = read_json_object(results / PROVENANCE_NAME, advice="name a folder of results")
    if "sha256" not in note or note.get("command") not in _WRITERS:
        raise InputError(
            f"expected results of tactileq analyze in {results}, got those of "
            f"{note.get('command', 'another program')}, or of an earlier version; name the folder "
            "of an analysis."
        )
    require_data(note, data, results)
    differs = list(_changed(results, note["sha256"]))
    there = _files_in(results)
    said = f"results verified: {counted(len(there), 'file')}"
    if differs:
        return differs, f"{said}, {counted(len(differs), 'difference')}; not made again"
    reason = _not_again(note)
    if reason:
        return [], f"{said} as written; not made again ({reason})"
    again = list(_again(data, there, note, analyze=analyze))
    versions = _other_versions(note)
    outcome = counted(len(again), "difference") if again else "the same"
    return again, f"{said} as written; made again{versions}: {outcome}"


def verify_archive(archive: Path) -> tuple[list[str], str]:
    """Every file of an archive against the hashes that it holds, and these against its seal.

    Returns
    -------
    list of str
        A sentence for each difference.
    str
        What was compared.

    Raises
    ------
    InputError
        If its provenance cannot be read.
    """
    from tactileq.modeling.errors import counted
    from tactileq.modeling.files.documents import read_json_object
    from tactileq.modeling.files.hashes import seal_over
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    note = read_json_object(archive / PROVENANCE_NAME, advice="restore the archive")
    stated: Mapping[str, str] = note.get("sha256", {})
    differs = list(_changed(archive, stated))
    if (seal := seal_over(stated)) != note.get("seal"):
        sentence = f"expected the seal {seal} over its hashes, got {note.get('seal')}"
        differs.append(f"{archive / PROVENANCE_NAME}: {sentence}")
    said = f"archive verified: {counted(len(stated), 'file')}"
    if differs:
        return differs, f"{said}, {counted(len(differs), 'difference')}"
    return [], f"{said} as written, seal {seal}"


def _changed(folder: Path, stated: Mapping[str, str]) -> Iterator[str]:
    """Files that are not as their hashes say, not there, or not listed."""
    from tactileq.modeling.files.provenance import PROVENANCE_NAME, sha256_of_files

    there = sha256_of_files(folder)
    there.pop(PROVENANCE_NAME)
    for name in sorted({*stated, *there}):
        if stated.get(name) != there.get(name):
            got = "none" if name not in there else "another" if name in stated else "one"
            expected = "no such file" if got == "one" else "the file that was written"
            yield f"{folder / name}: expected {expected}, got {got}"


def _files_in(folder: Path) -> dict[str, Path]:
    """A folder's files but its provenance, by their paths in it."""
    from tactileq.modeling.files.places import matching
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    paths = (path for path in matching(folder, "**/*") if path.is_file())
    files = {path.relative_to(folder).as_posix(): path for path in paths}
    return {name: path for name, path in files.items() if name != PROVENANCE_NAME}


def require_data(note: Mapping[str, Any], data: Path, results: Path) -> None:
    """Refuse results of other data; a demo's are in its own folder."""
    from tactileq.modeling import InputError
    from tactileq.modeling.files.hashes import sha256_of_paths

    (now,) = sha256_of_paths([data]).values()
    own = data.resolve().is_relative_to(results.resolve())
    if not own and now not in note.get("inputs_sha256", {}).values():
        raise InputError(
            f"expected results of the data in {data}, got in {results} those of other data, or of "
            "these before they were changed; analyze them again, or name the data's own results."
        )


def _not_again(note: Mapping[str, Any]) -> str:
    """Why an analysis cannot be made again here; empty where it can."""
    options = note.get("options")
    if options is None:
        return f"{note['command']} makes more than an analysis"
    if len(options["data"]) > 1:
        return "of several set-ups"
    lost = [options[n] for n in _FOLDERS if options[n] and not Path(options[n]).exists()]
    return f"{lost[0]} is not here" if lost else ""


def _other_versions(note: Mapping[str, Any]) -> str:
    from tactileq.modeling.files.provenance import version_of

    stated: Mapping[str, str] = note.get("versions", {})
    other = [f"{n} {v}" for n, v in stated.items() if version_of(n) not in (v, None)]
    return f" (written with {', '.join(other)})" if other else ""


def _again(
    data: Path,
    there: Mapping[str, Path],
    note: Mapping[str, Any],
    *,
    analyze: Callable[..., None],
) -> Iterator[str]:
    """What differs when the analysis is made again with the same options."""
    options = dict(note["options"])
    given = {name: Path(options[name]) for name in _FOLDERS if options[name]}
    with tempfile.TemporaryDirectory() as folder:
        fresh = Path(folder) / "again"
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            analyze(**{**options, **given, "data": [str(data)]}, out=fresh)
        made = _files_in(fresh)
        for name in sorted({*there, *made}.difference(_ORIGIN)):
            if name not in made or name not in there:
                got = "none" if name in made else "one"
                yield f"{name}: expected what an analysis made again gives, got {got}"
            elif _without_origin(made[name]) != _without_origin(there[name]):
                yield f"{name}: expected what an analysis made again gives, got another"


def _without_origin(path: Path) -> bytes:
    """A file; a page without the table of its provenance, which names paths and versions."""
    return _PROVENANCE.sub(b"", path.read_bytes())
