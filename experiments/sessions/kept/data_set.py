"""Which study, models and participants a data folder accepts: those of its first session."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.kept.files import write_new
from tactileq.experiments.sessions.kept.log import plain
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.overrides import Overrides
from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.documents import dump_json, read_json_object
from tactileq.modeling.files.places import locked

# All that a version of this program ever wrote, the present one last: earlier data keep theirs.
BIDS_VERSIONS = ("1.10.0",)
DATASET_TYPE = "raw"
DESCRIPTION_NAME = "dataset_description.json"
# What may differ for a stated reason; people and simulations never share a folder.
MAY_DIFFER = {
    "StudySHA256": "study",
    "ModelsSHA256": "models",
    "TextsSHA256": "texts",
    "Pilot": "pilot",
}
# What is not always recorded (`SessionManifest.texts_sha256`): without it nothing is said of it.
_NOT_ALWAYS = ("TextsSHA256",)


def claim_data_set(root: Path, manifest: SessionManifest, *, overrides: Overrides) -> None:
    """Describe a new data set as the session's, or check that the one there takes the session.

    Parameters
    ----------
    root : Path
        Made if it is not there.
    overrides : Overrides
        Another study, other models or texts, and pilot data beside others, are against the rules.

    Raises
    ------
    InputError
        If it holds data of another study, of other models or texts, or of another kind of
        participants.
    OSError
        If the disk does not take the description.
    """
    path = root / DESCRIPTION_NAME
    with locked(path):
        try:
            write_new(path, dump_json(describe_data_set(manifest)).encode())
        except FileExistsError:
            require_same_data_set(root, manifest, overrides=overrides)


def require_same_data_set(root: Path, manifest: SessionManifest, *, overrides: Overrides) -> None:
    """Refuse a session that does not belong to the data set that is there, if one is.

    Raises
    ------
    InputError
        As `claim_data_set`.
    """
    path = root / DESCRIPTION_NAME
    if os.path.lexists(path):
        found = read_json_object(path, advice="choose another data folder for these sessions")
        _check(found, describe_data_set(manifest), path=path, overrides=overrides)


def require_rule(root: Path, study: Study) -> None:
    """Refuse to begin a data set of a study with a rule of verdicts that was withdrawn.

    Raises
    ------
    InputError
        Names the rule to write; not where the data set has begun.
    """
    if not os.path.lexists(root / DESCRIPTION_NAME):
        study.plan.require_current()


def require_study(root: Path, study: Study) -> None:
    """Refuse a data folder of another study, by its name: its file may have been edited since.

    Raises
    ------
    InputError
        Also where it does not describe its data.
    """
    path = root / DESCRIPTION_NAME
    found = read_json_object(path, advice="name the folder of the study's data").get("Name")
    if found != study.name:
        raise InputError(
            f"expected the data of the study {shown(study.name)} in {root}, got those of "
            f"{shown(found)}; name their folder with --data, or the other study."
        )


def describe_data_set(manifest: SessionManifest) -> dict[str, Any]:
    """The description of a data set that begins with this session."""
    study = manifest.study
    described: dict[str, Any] = plain(
        {
            "Name": study.get("name", "not stated"),
            "BIDSVersion": BIDS_VERSIONS[-1],
            "DatasetType": DATASET_TYPE,
            "License": study.get("data_license", "not stated"),
            "Simulated": manifest.simulated,
            "SimulatedParticipant": manifest.simulated_participant,
            "SimulatedRig": manifest.simulated_rig,
            "Pilot": manifest.pilot,
            "StudySHA256": manifest.study_sha256,
            "ModelsSHA256": manifest.models_sha256,
            **({"TextsSHA256": manifest.texts_sha256} if manifest.texts_sha256 else {}),
            "StudyDesign": study,
            "GeneratedBy": [generated_by(manifest)],
        }
    )
    return described


def is_other(name: str, described: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two descriptions state different things under a name."""
    if name in _NOT_ALWAYS and not (name in described and name in other):
        return False
    return described.get(name) != other.get(name)


def generated_by(manifest: SessionManifest) -> dict[str, str]:
    """The program that a session was run by, as the description names it."""
    return {"Name": "tactileq", "Version": manifest.versions.get("tactileq", "")}


def _check(
    found: Mapping[str, Any], wanted: Mapping[str, Any], *, path: Path, overrides: Overrides
) -> None:
    for key in ("SimulatedParticipant", "SimulatedRig"):
        if found.get(key) is not wanted[key]:
            raise InputError(
                f"expected a data folder with {key} {wanted[key]} in {path}, got "
                f"{shown(found.get(key))}; choose another data folder for these sessions, since "
                "people and simulations never share one."
            )
    for key, what in MAY_DIFFER.items():
        if is_other(key, found, wanted):
            overrides.allow(
                what,
                f"expected a data folder of this {_differs(key, found, wanted)} in {path}; choose "
                "another data folder for these sessions",
            )


def _differs(key: str, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    if key == "StudySHA256":
        return f"study, got another {differing(found.get('StudyDesign'), wanted['StudyDesign'])}"
    if key in ("ModelsSHA256", "TextsSHA256"):
        what = "set of models" if key == "ModelsSHA256" else "wording of what participants read"
        return f"{what}, got another {differing(found.get(key), wanted[key])}"
    return f"kind (pilot {wanted[key]}), got {shown(found.get(key))}"


def differing(there: object, here: Mapping[str, Any]) -> str:
    """The names whose values differ; what is there, where that has no names."""
    if not isinstance(there, dict):
        return shown(there)
    names = sorted(k for k in there.keys() | here if there.get(k) != here.get(k))
    return ", ".join(names) or "hash"
