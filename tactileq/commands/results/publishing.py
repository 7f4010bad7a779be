"""An archive of a study that stands alone: data, models, report and what describes them.

docs/method/publishing.md
"""

from __future__ import annotations

import contextlib
import getpass
import io
import os
import platform
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactileq.experiments.publishing.archive import (
    DATA,
    PSYCH_DS,
    RECORDINGS,
    REPORT,
    REPORTED,
    SETS_OF_MODELS,
    STIMULI,
)
from tactileq.experiments.publishing.metadata import Publication, bids_description, write_metadata

if TYPE_CHECKING:
    from tactileq.experiments.publishing.redacting import Redacted
    from tactileq.experiments.sessions.kept.manifest import SessionManifest
    from tactileq.experiments.study.study import Study

# Words of a licence that forbid giving the models to others.
_FORBIDS = re.compile(
    r"no[- ]redistribution|not (?:for|be) redistribut|do not (?:re)?distribute|"
    r"all rights reserved|proprietary|confidential",
    re.IGNORECASE,
)
_MOMENT = re.compile(rb"(\d{4}-\d\d-\d\d)T\d\d:\d\d")
_SHORTEST_SECRET = 4  # shorter names of hosts and people stand in many words by chance
_SAY_NOTHING = ("root", "user", "admin", "runner", "localhost")


def check_publishable(study: Study, *, models: Iterable[str]) -> None:
    """Refuse a study without authors or licence, and models that may not be given on.

    Raises
    ------
    InputError
        Naming the key of the study file, or the set of models.
    """
    from tactileq.modeling import InputError

    stated = study.publication
    if stated is None or not stated.authors:
        raise InputError(
            "expected authors of the archive, got none; name them in the study file under "
            "[[publication.authors]], with family and given."
        )
    if (stated.license or study.data_license) == "not stated":
        raise InputError(
            'expected a licence of the data, got "not stated"; write license = "CC0-1.0" or '
            "another one under [publication] in the study file."
        )
    for name in models:
        licence = stated.model_licenses.get(name, "")
        if _FORBIDS.search(licence):
            raise InputError(
                f"expected a licence that lets the {name} models be given to others, got "
                f"{licence!r}; leave them out with --without {name}."
            )


def checked_models(
    manifests: Sequence[SessionManifest], given: Mapping[str, Path], *, without: Sequence[str]
) -> tuple[dict[str, Path], tuple[str, ...]]:
    """The folder of each set of models that sessions presented, and the sets that are not here.

    Parameters
    ----------
    given : mapping of set to Path
        Instead of the places that manifests name.

    Raises
    ------
    InputError
        For models that are not those that were presented, and for a set of another name.
    """
    from tactileq.commands.results.verification import differing_models
    from tactileq.modeling import InputError
    from tactileq.modeling.checks import check_keys

    names = tuple(dict.fromkeys(name for one in manifests for name in one.study["models"]))
    check_keys(given, names, where="the sets of models of the study")
    check_keys(dict.fromkeys(without), names, where="--without")
    places: dict[str, Path] = {}
    for one in manifests:
        places |= {name: Path(place) for name, place in one.model_sources.items()}
    places |= given
    wanted = [name for name in names if name not in without]
    here = {name: places[name] for name in wanted if name in places and places[name].is_dir()}
    for name, place in here.items():
        for sentence in differing_models(name, place, manifests):
            raise InputError(
                f"{sentence}; name the folder with --models {name}=FOLDER, or leave the set out "
                f"with --without {name}."
            )
    return here, tuple(name for name in wanted if name not in here)


def assemble(archive: Path, publication: Publication, *, analyze: Any) -> dict[str, Any]:
    """Write everything into a new folder but its provenance, and return what that states.

    Raises
    ------
    InputError
        For what a part refuses, for a file that no part lists, and for one that would identify
        somebody.
    """
    from tactileq.commands.results.published_parts import write_models, write_stimuli
    from tactileq.experiments.publishing.redacting import redact

    stated = publication.stated
    sources = {name: f"{SETS_OF_MODELS}/{name}" for name in publication.models}
    redacted = redact(
        publication.data,
        archive / DATA,
        sources=sources,
        described=bids_description(publication),
        free_text=publication.free_text,
    )
    listed = set(redacted.files)
    for name, place in publication.models.items():
        target = archive / SETS_OF_MODELS / name
        listed |= {*write_models(place, target, textures=publication.textures)}
    if publication.stimuli is not None:
        listed |= {*write_stimuli(publication.stimuli, archive / STIMULI)}
    listed |= {_write_study(archive / "study.toml", publication.study)}
    listed |= {*_analyze(archive, publication, analyze)}
    listed |= {*write_metadata(archive, publication)}
    _require_listed(archive, listed)
    _require_nobody_named(archive, redacted, data=publication.data)
    return {
        "title": publication.title,
        "authors": [f"{author.family}, {author.given}" for author in stated.authors],
        "original_seals": dict(redacted.seals),
    }


def _write_study(path: Path, study: Study) -> Path:
    """A study file with what was read of it: no comments."""
    import tomlkit

    path.write_text(tomlkit.dumps(study.to_tables()), encoding="utf-8")
    return path


def _analyze(archive: Path, publication: Publication, analyze: Any) -> Iterator[Path]:
    """The report of the archive's own data, with the options of the original one; its files."""
    from tactileq.commands.results.published_parts import write_models, write_recordings
    from tactileq.experiments.study.study import Study
    from tactileq.modeling.files.documents import read_json_object
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    options, textures = publication.options, publication.textures
    kept = {name: options.get(name) for name in ("exclude", "validate", "unverified")}
    places: dict[str, Path] = {}
    if recordings := options.get("recordings"):
        places = {"recordings": Path(RECORDINGS)}
        yield from write_recordings(Path(recordings), archive / RECORDINGS, textures=textures)
        for name in ("models", "simplified"):
            places[name] = Path(REPORTED) / name
            yield from write_models(Path(options[name]), archive / places[name], textures=textures)
    if later := options.get("plan"):
        places["plan"] = Path("later_plan.toml")
        yield _write_study(archive / places["plan"], Study.load(later))
    said = io.StringIO()
    with contextlib.chdir(archive), contextlib.redirect_stdout(said):
        analyze(
            data=[DATA],
            complete=bool(options.get("complete")),
            seed=int(options.get("seed") or 0),
            out=Path(REPORT),
            **places,
            **kept,
        )
    note = archive / REPORT / PROVENANCE_NAME
    names = read_json_object(note, advice="analyze again")["files"]
    yield from (note, *(archive / REPORT / name for name in names))


def _require_listed(archive: Path, listed: Collection[Path]) -> None:
    """Refuse to publish a file that no part of the archive lists, or a link.

    Raises
    ------
    InputError
        Naming the first one.
    """
    from tactileq.modeling import InputError

    for path in sorted(archive.rglob("*")):
        is_link = path.is_symlink()
        if is_link or (path not in listed and not path.is_dir()):
            got = f"a link to {path.readlink()}" if is_link else "one that nothing lists"
            raise InputError(
                f"expected only files that a part of the archive lists, got {got} at "
                f"{path.relative_to(archive)}; find out what put it there, and publish again."
            )


def _require_nobody_named(archive: Path, redacted: Redacted, *, data: Path) -> None:
    """Refuse to publish a file in which a pseudonym, a host, a user or a time of day stands.

    Raises
    ------
    InputError
        Naming the file and what stands in it.
    """
    from tactileq.modeling import InputError

    for path, content in _contents(archive):
        telling = _telling(redacted.secrets, data)
        found = next((word for word in telling if word.encode() in content), "")
        what = f"{found!r}"
        if not found and path.parts[0] in (DATA, PSYCH_DS):
            moments = _MOMENT.finditer(content)
            real = (m for m in moments if m[1].decode() not in redacted.days)
            if (first := next(real, None)) is not None:
                found = what = f"the time {first[0].decode()}"
        if found:
            raise InputError(
                f"expected nothing that identifies a participant or a machine, got {what} in "
                f"{path}; remove it from its source, or leave that part out."
            )


def _telling(secrets: Sequence[str], data: Path) -> Iterator[str]:
    with contextlib.suppress(OSError, KeyError):
        names = (platform.node(), getpass.getuser())
        telling = (name for name in names if len(name) >= _SHORTEST_SECRET)
        yield from (name for name in telling if name not in _SAY_NOTHING)
    yield from secrets
    for place in (Path.home(), data.absolute().parent):
        if len(place.parts) > 2:
            yield os.fspath(place)


def _contents(archive: Path) -> Iterator[tuple[Path, bytes]]:
    """Each file, its name before what it holds: both are published."""
    for path in sorted(archive.rglob("*")):
        if path.is_file():
            name = path.relative_to(archive)
            yield name, name.as_posix().encode() + b"\n" + path.read_bytes()
