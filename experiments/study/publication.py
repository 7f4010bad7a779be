"""Who is to be named, and under which licences, when the data are published: [publication]."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.kinds import Label, ListedLabel, is_label

_ORCID = r"^(\d{4}-){3}\d{3}[\dX]$"


def is_orcid(text: str) -> bool:
    """Whether this is an ORCID iD with its own check digit (ISO 7064, MOD 11-2); empty is one."""
    digits = text.replace("-", "")
    if not text:
        return True
    if len(digits) != 16 or not digits[:-1].isdigit():
        return False
    total = 0
    for digit in digits[:-1]:
        total = (total + int(digit)) * 2
    check = (12 - total % 11) % 11
    return digits[-1] == ("X" if check == 10 else str(check))


def is_label_or_none(text: str) -> bool:
    """Whether this is printable text in one line, or nothing."""
    return text == "" or is_label(text)


@dataclass(frozen=True, kw_only=True)
class AuthorSection(FileSection):
    """An author of the data."""

    WHERE: ClassVar[str] = "[[publication.authors]]"
    OPTIONAL: ClassVar[frozenset[str]] = frozenset({"orcid", "affiliation"})
    family: Annotated[Label, key("family name")]
    given: Annotated[Label, key("given names")]
    orcid: Annotated[
        str,
        key(
            "ORCID iD",
            expected="an ORCID iD with a right check digit, such as 0000-0002-1825-0097",
            pattern=_ORCID,
            holds=is_orcid,
        ),
    ] = ""
    affiliation: Annotated[str, key("institution", holds=is_label_or_none)] = ""


@dataclass(frozen=True, kw_only=True)
class PublicationSection(FileSection):
    """What an archive of the study states beside its data."""

    WHERE: ClassVar[str] = "[publication]"
    OPTIONAL: ClassVar[frozenset[str]] = frozenset({"description", "license", "ethics", "doi"})
    authors: Annotated[
        tuple[AuthorSection, ...], key("in the order in which they are named", min_length=1)
    ]
    description: Annotated[
        str, key("what the data are, in one sentence", holds=is_label_or_none)
    ] = ""
    license: Annotated[
        str,
        key("of the data, where the study was run without one", holds=is_label_or_none),
    ] = ""
    ethics: Annotated[
        str,
        key("the committee that approved the study, and its number", holds=is_label_or_none),
    ] = ""
    funding: Annotated[tuple[Label, ...], key("grants, with their numbers")] = ()
    keywords: Annotated[tuple[ListedLabel, ...], key("for catalogues")] = ()
    doi: Annotated[
        str,
        key(
            "of the archive, where one is reserved",
            expected="a DOI such as 10.1000/182",
            pattern=r"^10\.\d{4,}/\S+$",
        ),
    ] = ""
    model_licenses: Annotated[
        dict[ListedLabel, Label],
        key(
            "the licence of each set of models, where it is not that of the data; one that forbids "
            "redistribution stops tactileq publish"
        ),
    ] = field(default_factory=dict)
