"""What is fixed before the first trial of a session, and its basis.

docs/method/protocols.md#storing
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from experiments.sessions.files import SessionFiles
from experiments.sessions.log import plain
from experiments.sessions.program import program_facts
from modeling import InputError
from modeling.checks import check_keys
from modeling.errors import shown
from modeling.files.documents import dump_json, read_json_object
from modeling.files.hashes import sha256_of, sha256_of_values

FORMAT = "tactileq.session-manifest"
VERSION = 1
_ADVICE = "restore the file from a copy"
Values = Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class SessionManifest:
    """Everything that is known of a session before its first trial; plain values.

    Parameters
    ----------
    task : str
    subject, session, slot : int
        From 1; the balanced parts of the order follow from the slot.
    code : str
        The participant's pseudonym.
    language : str
    pilot : bool
    simulated_participant, simulated_rig : bool
    study : mapping
        The values of the study file.
    study_sha256, plan_sha256 : str
    models_sha256 : mapping of texture to mapping of set to SHA-256
    model_sources : mapping of set to path
    identical : mapping of texture to sequence of sequence of str
        Of the task's sets those whose models of a texture are equal, group by group: controls.
    rig : mapping
        What the rig states: its file's SHA-256, firmware, what is assumed.
    description : str
        What the participant does.
    trials : sequence of mapping
        Planned, in order; each with its number, `trial`, from 1.
    overrides : sequence of mapping
        What was allowed against a rule (`what`), and the `reason`.
    program : mapping, optional
        As `program_facts` says, where it is not given.
    """

    task: str
    subject: int
    session: int
    slot: int
    code: str
    language: str
    pilot: bool
    simulated_participant: bool
    simulated_rig: bool
    study: Values
    study_sha256: str
    plan_sha256: str
    models_sha256: Mapping[str, Mapping[str, str]]
    model_sources: Mapping[str, str]
    identical: Mapping[str, Sequence[Sequence[str]]]
    rig: Values
    description: str
    trials: Sequence[Values]
    overrides: Sequence[Mapping[str, str]] = ()
    program: Values = field(default_factory=program_facts)

    def files(self, data_folder: str | Path) -> SessionFiles:
        """Where the files of the session are in a data set."""
        root = Path(data_folder)
        return SessionFiles(root=root, task=self.task, subject=self.subject, session=self.session)

    @cached_property
    def values(self) -> dict[str, Any]:
        """All of it as JSON holds it, without the format and its version."""
        own = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "program"}
        trials = own.pop("trials")
        values: dict[str, Any] = plain({**own, **self.program, "trials": trials})
        return values

    @cached_property
    def text(self) -> str:
        """The contents of its file."""
        return dump_json({"format": FORMAT, "version": VERSION, **self.values})

    @property
    def sha256(self) -> str:
        """SHA-256 of its file, by which the log names it."""
        return sha256_of(self.text)

    @property
    def simulated(self) -> bool:
        """Whether the participant, the rig or both were simulated."""
        return self.simulated_participant or self.simulated_rig

    @staticmethod
    def load(path: str | Path) -> SessionManifest:
        """Read a manifest.

        Raises
        ------
        InputError
            If the file cannot be read or is no manifest of this version.
        """
        values = read_json_object(Path(path), advice=_ADVICE, what="the manifest of a session")
        stated = (values.pop("format", None), values.pop("version", None))
        if stated != (FORMAT, VERSION):
            raise InputError(
                f"expected {FORMAT} of version {VERSION} in {path}, got {shown(stated[0])} of "
                f"version {shown(stated[1])}; give a session's manifest, or update tactileq if it "
                "is newer."
            )
        _check(values, Path(path))
        program = {name: values.pop(name) for name in _PROGRAM}
        return SessionManifest(**values, program=program)


_PROGRAM = {
    "versions": dict,
    "platform": str,
    "git_revision": str,
    "git_uncommitted": bool | None,
    "lock_sha256": str,
}
_NUMBERS = ("subject", "session", "slot")
_KINDS: dict[str, Any] = {
    **dict.fromkeys(("task", "code", "language", "study_sha256", "plan_sha256"), str),
    **dict.fromkeys(_NUMBERS, int),
    **dict.fromkeys(("pilot", "simulated_participant", "simulated_rig"), bool),
    **dict.fromkeys(("study", "models_sha256", "model_sources", "identical", "rig"), dict),
    **dict.fromkeys(("trials", "overrides"), list),
    "description": str,
    **_PROGRAM,
}


def _check(values: Mapping[str, Any], path: Path) -> None:
    check_keys(values, tuple(_KINDS), where=str(path))
    for name, kind in _KINDS.items():
        if name not in values or not isinstance(values[name], kind):
            raise _refused(path, name, values.get(name))
    if any(isinstance(values[name], bool) or values[name] < 1 for name in _NUMBERS):
        raise _refused(path, "numbers from 1", [values[name] for name in _NUMBERS])
    if sha256_of_values(values["study"]) != values["study_sha256"]:
        raise _refused(path, "the study of the stated SHA-256", values["study_sha256"])
    if not all(isinstance(one, dict) for one in values["overrides"]):
        raise _refused(path, "overrides", values["overrides"])
    for number, trial in enumerate(values["trials"], start=1):
        if not isinstance(trial, dict) or trial.get("trial") != number:
            raise _refused(path, f"trial {number} of trials", trial)
        if not isinstance(trial.get("phase"), str):
            raise _refused(path, f"the phase of trial {number}", trial.get("phase"))


def _refused(path: Path, name: str, got: object) -> InputError:
    return InputError(f"expected {name} in the manifest {path}, got {shown(got)}; {_ADVICE}.")
