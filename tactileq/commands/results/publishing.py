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
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
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
    from tactileq.experiments.sessions.kept.manifest import SessionManifest
    from tactileq.experiments.study.study import Study

# Words of a licence that forbid giving the models to others.
_FORBIDS = re.compile(
    r"no[- ]redistribution|not (?:for|be) redistribut|do not (?:re)?distribute|"
    r"all rights reserved|proprietary|confidential",
    re.IGNORECASE,
)
_MOMENT = re.compile(rb"\d{4}-\d\d-\d\dT\d\d:\d\d")
_MOMENT_OF_COPIES = re.compile(rb"2000-\d\d-\d\dT")
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
        For what a part refuses, and for a file that would identify somebody.
    """
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
    for name, place in publication.models.items():
        _copy(place, archive / SETS_OF_MODELS / name, endings=(".json",))
    if publication.stimuli is not None:
        _copy(publication.stimuli, archive / STIMULI)
    _write_study(archive / "study.toml", publication.study)
    _analyze(archive, publication.options, analyze)
    write_metadata(archive, publication)
    _require_nobody_named(archive, redacted.secrets, data=publication.data)
    return {
        "title": publication.study.name,
        "authors": [f"{author.family}, {author.given}" for author in stated.authors],
        "original_seals": dict(redacted.seals),
    }


def _copy(place: Path, target: Path, endings: tuple[str, ...] = ("",)) -> None:
    """A folder's files with these endings, without notes on where they come from."""
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    for path in sorted(place.rglob("*")):
        named = path.name.endswith(endings) and not path.name.endswith(PROVENANCE_NAME)
        if path.is_file() and named:
            new = target / path.relative_to(place)
            new.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, new)


def _write_study(path: Path, study: Study) -> None:
    import tomlkit

    path.write_text(tomlkit.dumps(study.to_tables()), encoding="utf-8")


def _analyze(archive: Path, options: Mapping[str, Any], analyze: Any) -> None:
    """The report of the archive's own data, with the options of the original one."""
    kept = {name: options.get(name) for name in ("exclude", "validate", "unverified")}
    places: dict[str, Path] = {}
    if recordings := options.get("recordings"):
        _copy(Path(recordings), archive / RECORDINGS)
        places = {"recordings": Path(RECORDINGS)}
        for name in ("models", "simplified"):
            _copy(Path(options[name]), archive / REPORTED / name, endings=(".json",))
            places[name] = Path(REPORTED) / name
    if later := options.get("plan"):
        shutil.copyfile(later, archive / "later_plan.toml")
        places["plan"] = Path("later_plan.toml")
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


def _require_nobody_named(archive: Path, secrets: Sequence[str], *, data: Path) -> None:
    """Refuse to publish a file in which a pseudonym, a host, a user or a time of day stands.

    Raises
    ------
    InputError
        Naming the file and what stands in it.
    """
    from tactileq.modeling import InputError

    for path, content in _contents(archive):
        found = next((word for word in _telling(secrets, data) if word.encode() in content), "")
        what = f"{found!r}"
        if not found and path.parts[0] in (DATA, PSYCH_DS):
            moments = (m for m in _MOMENT.finditer(content))
            real = (m for m in moments if not _MOMENT_OF_COPIES.match(content, m.start()))
            if (first := next(real, None)) is not None:
                found = what = f"the time {first.group().decode()}"
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
    for path in sorted(archive.rglob("*")):
        if path.is_file():
            yield path.relative_to(archive), path.read_bytes()
