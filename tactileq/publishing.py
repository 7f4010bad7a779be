"""An archive of a study that stands alone: data, models, report and what describes them.

docs/method/publishing.md
"""

from __future__ import annotations

import contextlib
import csv
import getpass
import io
import json
import os
import platform
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactileq.archive import DATA, REPORT

if TYPE_CHECKING:
    from experiments.study.publication import PublicationSection
    from experiments.study.study import Study

MODELS, STIMULI, PSYCH_DS = "models", "stimuli", "psych-ds"
# What the report was made with beside the data.
RECORDINGS, REPORTED = "recordings", "reported_models"
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


@dataclass(frozen=True, kw_only=True)
class Publication:
    """What is to be published, and under which names.

    Parameters
    ----------
    study : Study
        As it was run, with what its file says of the publication.
    data : Path
        The original.
    models : mapping of set to Path
        Folders of the models that were presented.
    stimuli : Path, optional
        A stimulus set.
    options : mapping
        Those of the analysis whose report is published.
    free_text : bool
        Whether what people typed is published.
    """

    study: Study
    data: Path
    models: Mapping[str, Path]
    stimuli: Path | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    free_text: bool = False

    @property
    def stated(self) -> PublicationSection:
        """What the study file says of the publication."""
        assert self.study.publication is not None
        return self.study.publication

    @property
    def license(self) -> str:
        """Of the data."""
        return self.stated.license or self.study.data_license


def check_publishable(study: Study, *, models: Iterable[str]) -> None:
    """Refuse a study without authors or licence, and models that may not be given on.

    Raises
    ------
    InputError
        Naming the key of the study file, or the set of models.
    """
    from modeling import InputError

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
    data: Path, given: Mapping[str, Path], *, without: Sequence[str]
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
    from experiments.sessions.stored_sessions import held_sessions
    from experiments.study.models import model_sha256
    from modeling import InputError
    from modeling.checks import check_keys
    from modeling.models.loading import load_any_models

    held, _ = held_sessions(data)
    names = tuple(dict.fromkeys(n for one in held for n in one.manifest.study["models"]))
    check_keys(given, names, where="the sets of models of the study")
    check_keys(dict.fromkeys(without), names, where="--without")
    places: dict[str, Path] = {}
    for one in held:
        places |= {name: Path(place) for name, place in one.manifest.model_sources.items()}
    places |= given
    here = {name: places[name] for name in names if name in places and places[name].is_dir()}
    here = {name: place for name, place in here.items() if name not in without}
    for name, place in here.items():
        found = load_any_models(place)
        for one in held:
            for texture, hashes in one.manifest.models_sha256.items():
                model = found.get(texture)
                if model is None or model_sha256(model) != hashes[name]:
                    got = "none" if model is None else "another"
                    raise InputError(
                        f"expected in {place} the {name} model of {texture} that "
                        f"{one.files.stem} presented, got {got}; name the folder with --models "
                        f"{name}=FOLDER, or leave the set out with --without {name}."
                    )
    return here, tuple(name for name in names if name not in here and name not in without)


def assemble(archive: Path, publication: Publication, *, analyze: Any) -> dict[str, Any]:
    """Write everything into a new folder but its provenance, and return what that states.

    Raises
    ------
    InputError
        For what a part refuses, and for a file that would identify somebody.
    """
    from experiments.publishing.redacting import redact

    stated = publication.stated
    sources = {name: f"{MODELS}/{name}" for name in publication.models}
    redacted = redact(
        publication.data,
        archive / DATA,
        sources=sources,
        described=_described(publication),
        free_text=publication.free_text,
    )
    for name, place in publication.models.items():
        _copy(place, archive / MODELS / name, endings=(".json",))
    if publication.stimuli is not None:
        _copy(publication.stimuli, archive / STIMULI)
    _write_study(archive / "study.toml", publication.study)
    _analyze(archive, publication.options, analyze)
    _write_psych_ds(archive, publication)
    _write_citation(archive / "CITATION.cff", publication)
    _write_json(archive / "datacite.json", _datacite(publication))
    (archive / "README.md").write_text(_readme(archive, publication), encoding="utf-8")
    _write_crate(archive, publication)
    _require_nobody_named(archive, redacted.secrets, data=publication.data)
    return {
        "title": publication.study.name,
        "authors": [f"{author.family}, {author.given}" for author in stated.authors],
        "original_seals": dict(redacted.seals),
    }


def _described(publication: Publication) -> dict[str, Any]:
    """Of the description of the data set, by BIDS."""
    stated = publication.stated
    values: dict[str, Any] = {
        "License": publication.license,
        "Authors": [f"{author.given} {author.family}" for author in stated.authors],
        "Keywords": list(stated.keywords),
        "Funding": list(stated.funding),
        "EthicsApprovals": [stated.ethics] * bool(stated.ethics),
        "DatasetDOI": f"doi:{stated.doi}" * bool(stated.doi),
    }
    return {name: value for name, value in values.items() if value}


def _copy(place: Path, target: Path, endings: tuple[str, ...] = ("",)) -> None:
    """A folder's files with these endings, without notes on where they come from."""
    from modeling.files.provenance import PROVENANCE_NAME

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


def _write_json(path: Path, values: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(values, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _answer_tables(archive: Path) -> list[Path]:
    return sorted((archive / DATA).glob("sub-*/ses-*/beh/*_beh.tsv"))


def _write_psych_ds(archive: Path, publication: Publication) -> None:
    """The answers as Psych-DS 1.0 wants them: CSV files that end with _data.csv, described."""
    folder = archive / PSYCH_DS
    (folder / "data").mkdir(parents=True)
    variables: dict[str, str] = {}
    for table in _answer_tables(archive):
        described = json.loads(table.with_suffix(".json").read_text("utf-8"))
        with table.open(encoding="utf-8", newline="") as file:
            header, *rows = csv.reader(file, delimiter="\t")
        about = ["participant_id", "session_id", "task"]
        subject, session, task = table.name.removesuffix("_beh.tsv").split("_")
        named = table.name.replace("sub-", "subject-").replace("ses-", "session-")
        target = folder / "data" / named.replace("_beh.tsv", "_data.csv")
        with target.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([*about, *header])
            cells = [subject, session, task.removeprefix("task-")]
            writer.writerows([*cells, *("" if cell == "n/a" else cell for cell in r)] for r in rows)
        variables |= dict.fromkeys(about, "")
        variables |= {
            name: described[name].get("Description", "") if name in described else ""
            for name in header
        }
    _write_json(
        folder / "dataset_description.json",
        {
            "@context": "https://schema.org/",
            "@type": "Dataset",
            "name": publication.study.name,
            "description": _description(publication),
            "license": publication.license,
            "author": [_person(author) for author in publication.stated.authors],
            "keywords": list(publication.stated.keywords),
            "variableMeasured": [
                {"@type": "PropertyValue", "name": name, "description": text}
                if text
                else {"@type": "PropertyValue", "name": name}
                for name, text in variables.items()
            ],
        },
    )


def _person(author: Any) -> dict[str, Any]:
    """An author in the terms of schema.org."""
    values = {
        "@type": "Person",
        "@id": f"https://orcid.org/{author.orcid}" if author.orcid else "",
        "givenName": author.given,
        "familyName": author.family,
        "affiliation": author.affiliation,
    }
    return {name: value for name, value in values.items() if value}


def _description(publication: Publication) -> str:
    kind = "Simulated answers" if _is_simulated(publication.data) else "Answers of participants"
    return publication.stated.description or f"{kind} of the study {publication.study.name}."


def _is_simulated(data: Path) -> bool:
    found = json.loads((data / "dataset_description.json").read_text("utf-8"))
    return bool(found.get("SimulatedParticipant"))


def _write_citation(path: Path, publication: Publication) -> None:
    """CITATION.cff 1.2.0; JSON is YAML, so texts are quoted as JSON quotes them."""
    quoted = json.dumps
    lines = [
        "cff-version: 1.2.0",
        'message: "If you use these data, please cite them as below."',
        "type: dataset",
        f"title: {quoted(publication.study.name, ensure_ascii=False)}",
        "authors:",
    ]
    for author in publication.stated.authors:
        lines.append(f"  - family-names: {quoted(author.family, ensure_ascii=False)}")
        lines.append(f"    given-names: {quoted(author.given, ensure_ascii=False)}")
        if author.orcid:
            lines.append(f'    orcid: "https://orcid.org/{author.orcid}"')
        if author.affiliation:
            lines.append(f"    affiliation: {quoted(author.affiliation, ensure_ascii=False)}")
    if publication.stated.doi:
        lines.append(f"doi: {quoted(publication.stated.doi)}")
    if publication.stated.keywords:
        lines.append(f"keywords: {quoted(list(publication.stated.keywords), ensure_ascii=False)}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _datacite(publication: Publication) -> dict[str, Any]:
    """DataCite metadata, schema 4; ":unav" is its word for what is not known yet."""
    stated = publication.stated
    creators = []
    for author in stated.authors:
        creator: dict[str, Any] = {
            "name": f"{author.family}, {author.given}",
            "nameType": "Personal",
            "givenName": author.given,
            "familyName": author.family,
        }
        if author.orcid:
            creator["nameIdentifiers"] = [
                {
                    "nameIdentifier": f"https://orcid.org/{author.orcid}",
                    "nameIdentifierScheme": "ORCID",
                    "schemeUri": "https://orcid.org",
                }
            ]
        if author.affiliation:
            creator["affiliation"] = [{"name": author.affiliation}]
        creators.append(creator)
    return {
        **({"doi": stated.doi} if stated.doi else {}),
        "types": {"resourceTypeGeneral": "Dataset", "resourceType": "Psychophysics"},
        "creators": creators,
        "titles": [{"title": publication.study.name}],
        "publisher": {"name": ":unav"},
        "publicationYear": str(_today().year),
        "subjects": [{"subject": word} for word in stated.keywords],
        "descriptions": [{"description": _description(publication), "descriptionType": "Abstract"}],
        "rightsList": [{"rights": publication.license}],
        "fundingReferences": [{"funderName": text} for text in stated.funding],
        "schemaVersion": "http://datacite.org/schema/kernel-4",
    }


def _today() -> Any:
    from experiments.sessions.log import now_utc

    return now_utc().date()


def _write_crate(archive: Path, publication: Publication) -> None:
    """RO-Crate metadata of the folder as it is."""
    from modeling.extras import extra

    with extra("publish"):
        from rocrate.model.person import Person
        from rocrate.rocrate import ROCrate
    crate = ROCrate()
    crate.name = publication.study.name
    crate.description = _description(publication)
    crate.datePublished = _today().isoformat()
    crate.license = publication.license
    crate.keywords = list(publication.stated.keywords)
    people = []
    for author in publication.stated.authors:
        values = _person(author)
        at, _ = values.pop("@id", None), values.pop("@type")
        people.append(crate.add(Person(crate, at, properties=values)))
    crate.root_dataset["author"] = people
    crate.root_dataset["funding"] = list(publication.stated.funding)
    for name, text in _PARTS.items():
        if (archive / name).is_dir():
            crate.add_dataset(dest_path=name, properties={"name": text})
    for name, text in _FILES.items():
        if (archive / name).is_file():
            crate.add_file(dest_path=name, properties={"name": text})
    crate.metadata.write(archive)


_PARTS = {
    DATA: "Answers and logs of all sessions, a BIDS data set",
    MODELS: "Models and simplifications that were presented",
    STIMULI: "Stimulus files",
    RECORDINGS: "Recordings that the report compares models with",
    REPORTED: "Models that the report states the accuracy of",
    REPORT: "Report of tactileq analyze with its tables and figures",
    PSYCH_DS: "The answers once more, as Psych-DS",
}
_FILES = {
    "README.md": "What is in this archive, and how to check it",
    "study.toml": "The study: design, plan of the analysis, publication",
    "datacite.json": "DataCite metadata",
    "CITATION.cff": "How to cite",
}


def _readme(archive: Path, publication: Publication) -> str:
    stated = publication.stated
    lines = [f"# {publication.study.name}", "", _description(publication), ""]
    lines += [f"- `{name}/`: {text}." for name, text in _PARTS.items() if (archive / name).is_dir()]
    lines += [f"- `{name}`: {text}." for name, text in _FILES.items() if name != "README.md"]
    lines += [
        "",
        f"Licence of the data: {publication.license}.",
        *(f"Licence of the {n} models: {v}." for n, v in stated.model_licenses.items()),
        *([f"Ethics: {stated.ethics}."] * bool(stated.ethics)),
        *(f"Funding: {text}." for text in stated.funding),
        "",
        "Times of day, pseudonyms and free text are left out: every participant's first session "
        "begins at noon on 2000-01-01, and logs are sealed anew. `provenance.json` holds the "
        "SHA-256 of every file and the seals of the original logs. With tactileq installed, in "
        "this folder:",
        "",
        "    tactileq verify .",
        f"    tactileq analyze {DATA} --out again",
        "",
    ]
    return "\n".join(lines)


def _require_nobody_named(archive: Path, secrets: Sequence[str], *, data: Path) -> None:
    """Refuse to publish a file in which a pseudonym, a host, a user or a time of day stands.

    Raises
    ------
    InputError
        Naming the file and what stands in it.
    """
    from modeling import InputError

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
