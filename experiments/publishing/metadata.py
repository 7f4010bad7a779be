"""What describes an archive: for BIDS, Psych-DS, DataCite, RO-Crate, for citing and for reading.

docs/method/publishing.md
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
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
from tactileq.modeling.files.places import matching
from tactileq.modeling.files.tables import guarded

if TYPE_CHECKING:
    from tactileq.experiments.study.publication import PublicationSection
    from tactileq.experiments.study.study import Study


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
    textures : frozenset of str
        Those that sessions presented, whose models are published.
    free_text : bool
        Whether what people typed is published.
    simulated_participants, simulated_rig : bool
        Whether no person took part, and whether nothing was played to one.
    """

    study: Study
    data: Path
    models: Mapping[str, Path]
    stimuli: Path | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    textures: frozenset[str] = frozenset()
    free_text: bool = False
    simulated_participants: bool = False
    simulated_rig: bool = False

    @property
    def stated(self) -> PublicationSection:
        """What the study file says of the publication."""
        assert self.study.publication is not None
        return self.study.publication

    @property
    def simulated(self) -> str:
        """What was simulated; empty where nothing was."""
        parts = {"participants": self.simulated_participants, "rig": self.simulated_rig}
        named = " and ".join(name for name, simulated in parts.items() if simulated)
        return f"Simulated {named}" if named else ""

    @property
    def title(self) -> str:
        """The study's name, behind what was simulated: catalogues show nothing else."""
        return f"{self.simulated}: {self.study.name}" if self.simulated else self.study.name

    @property
    def description(self) -> str:
        """What the study file states, behind what was simulated, too."""
        mark = f"{self.simulated}. " if self.simulated else ""
        return mark + (self.stated.description or f"Answers in the study {self.study.name}.")

    @property
    def license(self) -> str:
        """Of the data."""
        return self.stated.license or self.study.data_license


def write_metadata(archive: Path, publication: Publication) -> list[Path]:
    """All that describes an archive whose other parts are there; what was written."""
    psych_ds = _write_psych_ds(archive, publication)
    _write_citation(archive / "CITATION.cff", publication)
    _write_json(archive / "datacite.json", _datacite(publication))
    (archive / "README.md").write_text(_readme(archive, publication), encoding="utf-8")
    _write_crate(archive, publication)
    names = ("CITATION.cff", "datacite.json", "README.md", "ro-crate-metadata.json")
    return [*psych_ds, *(archive / name for name in names)]


def bids_description(publication: Publication) -> dict[str, Any]:
    """What the description of the data set states in addition, by BIDS, and its name."""
    stated = publication.stated
    values: dict[str, Any] = {
        "Name": publication.title,
        "License": publication.license,
        "Authors": [f"{author.given} {author.family}" for author in stated.authors],
        "Keywords": list(stated.keywords),
        "Funding": list(stated.funding),
        "EthicsApprovals": [stated.ethics] * bool(stated.ethics),
        "DatasetDOI": f"doi:{stated.doi}" * bool(stated.doi),
    }
    return {name: value for name, value in values.items() if value}


def _write_json(path: Path, values: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(values, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _answer_tables(archive: Path) -> list[Path]:
    return matching(archive / DATA, "sub-*/ses-*/beh/*_beh.tsv")


def _write_psych_ds(archive: Path, publication: Publication) -> list[Path]:
    """The answers as Psych-DS 1.0 wants them: CSV files that end with _data.csv, described.

    CSV is what spreadsheets open, so cells are `guarded`; the BIDS tables hold values as they are.
    """
    folder = archive / PSYCH_DS
    (folder / "data").mkdir(parents=True)
    written = []
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
            shown = (["" if cell == "n/a" else guarded(cell) for cell in row] for row in rows)
            writer.writerows([*cells, *row] for row in shown)
        written.append(target)
        variables |= dict.fromkeys(about, "")
        variables |= {
            name: described[name].get("Description", "") if name in described else ""
            for name in header
        }
    described_by = folder / "dataset_description.json"
    _write_json(
        described_by,
        {
            "@context": "https://schema.org/",
            "@type": "Dataset",
            "name": publication.title,
            "description": publication.description,
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
    return [*written, described_by]


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


def _write_citation(path: Path, publication: Publication) -> None:
    """CITATION.cff 1.2.0; JSON is YAML, so texts are quoted as JSON quotes them."""
    quoted = json.dumps
    lines = [
        "cff-version: 1.2.0",
        'message: "If you use these data, please cite them as below."',
        "type: dataset",
        f"title: {quoted(publication.title, ensure_ascii=False)}",
        f"abstract: {quoted(publication.description, ensure_ascii=False)}",
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
        "titles": [{"title": publication.title}],
        "publisher": {"name": ":unav"},
        "publicationYear": str(_today().year),
        "subjects": [{"subject": word} for word in stated.keywords],
        "descriptions": [{"description": publication.description, "descriptionType": "Abstract"}],
        "rightsList": [{"rights": publication.license}],
        "fundingReferences": [{"funderName": text} for text in stated.funding],
        "schemaVersion": "http://datacite.org/schema/kernel-4",
    }


def _today() -> Any:
    from tactileq.experiments.sessions.kept.log import now_utc

    return now_utc().date()


def _write_crate(archive: Path, publication: Publication) -> None:
    """RO-Crate metadata of the folder as it is."""
    from tactileq.modeling.extras import extra

    with extra("publish"):
        from rocrate.model.person import Person
        from rocrate.rocrate import ROCrate
    crate = ROCrate()
    crate.name = publication.title
    crate.description = publication.description
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
    SETS_OF_MODELS: "Models and simplifications that were presented",
    STIMULI: "Stimulus files",
    RECORDINGS: "Recordings that the report compares models with",
    REPORTED: "Models that the report states the accuracy of",
    REPORT: "Report of tactileq analyze with its tables and figures",
    PSYCH_DS: "The answers once more, as Psych-DS (text that begins with =, +, - or @ has ' before "
    "it, since spreadsheets would calculate it)",
}
_FILES = {
    "README.md": "What is in this archive, and how to check it",
    "study.toml": "The study: design, plan of the analysis, publication",
    "datacite.json": "DataCite metadata",
    "CITATION.cff": "How to cite",
}


def _program() -> str:
    """What wrote the archive, by which it can be verified: its version and commit."""
    from tactileq.experiments.sessions.kept.program import program_facts

    facts = program_facts()
    changed = ", with uncommitted changes" if facts["git_uncommitted"] else ""
    revision = f" (git revision {facts['git_revision']}{changed})" if facts["git_revision"] else ""
    return f"tactileq {facts['versions'].get('tactileq', 'of unknown version')}{revision}"


def _readme(archive: Path, publication: Publication) -> str:
    stated = publication.stated
    lines = [f"# {publication.title}", "", publication.description, ""]
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
        "SHA-256 of every file and the seals of the original logs.",
        "",
        f"Written by {_program()}. With the same version installed, in this folder:",
        "",
        "    tactileq verify .",
        f"    tactileq analyze {DATA} --out again",
        "",
    ]
    return "\n".join(lines)
