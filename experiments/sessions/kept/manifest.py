"""What is fixed before the first trial of a session, and its basis.

docs/method/protocols.md#storing
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.log import plain
from tactileq.experiments.study.study import Language
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.described import key
from tactileq.modeling.files.described_json import DescribedJson
from tactileq.modeling.files.hashes import sha256_of_values

_FromOne = Annotated[int, key(ge=1)]
_Plain = Annotated[Mapping[str, Any], key(reads=plain)]


def _in_order(trials: Sequence[Mapping[str, Any]]) -> bool:
    numbered = all(trial.get("trial") == n for n, trial in enumerate(trials, start=1))
    return numbered and all(isinstance(trial.get("phase"), str) for trial in trials)


@dataclass(frozen=True, kw_only=True)
class SessionManifest(DescribedJson):
    """Everything that is known of a session before its first trial; plain values.

    The keys from `versions` to `lock_sha256` are as `program_facts` says.
    """

    WHAT = "the manifest of a session"
    FORMAT = "tactileq.session-manifest"
    ADVICE = "restore the file from a copy"
    OPTIONAL = frozenset({"after", "texts_sha256"})

    task: Annotated[str, key("as in the study file")]
    subject: Annotated[_FromOne, key("number of the participant")]
    session: Annotated[_FromOne, key("number of the participant's session")]
    slot: Annotated[_FromOne, key("the balanced parts of the order follow from it")]
    code: Annotated[str, key("the participant's pseudonym")]
    language: Annotated[str, key("of what the participant reads")]
    texts_sha256: Annotated[
        Mapping[Language, Annotated[str, key(pattern="^[0-9a-f]{64}$")]] | None,
        key(
            "of what participants read in each language of the study, by which its file in "
            "sourcedata is named; missing where that was not recorded: of earlier versions, and of "
            "simulated participants, who read nothing"
        ),
    ] = None
    pilot: Annotated[bool, key("whether it is a pilot")]
    simulated_participant: Annotated[bool, key("whether a program answered")]
    simulated_rig: Annotated[bool, key("whether nothing was played to a person")]
    study: Annotated[_Plain, key("the values of the study file")]
    study_sha256: Annotated[str, key("of these values")]
    plan_sha256: Annotated[str, key("of the study and the hashes of its models")]
    models_sha256: Annotated[
        Mapping[str, Mapping[str, str]], key("of each texture in each set of models")
    ]
    model_sources: Annotated[Mapping[str, str], key("the path of each set of models")]
    identical: Annotated[
        Mapping[str, tuple[tuple[str, ...], ...]],
        key(
            "for each texture, those of the task's sets whose models of it are equal, group by "
            "group: controls"
        ),
    ]
    rig: Annotated[
        _Plain, key("what the rig states: its file's SHA-256, firmware, what is assumed")
    ]
    description: Annotated[str, key("what the participant does")]
    overrides: Annotated[
        tuple[Mapping[str, str], ...],
        key("what was allowed against a rule (`what`), and the `reason`"),
    ] = ()
    after: Annotated[
        Mapping[str, str] | None,
        key(
            "the session that ended last before this one, by its `session`, and the `seal` of its "
            "log; empty before the first, missing of earlier versions, whose logs have no seals"
        ),
    ] = None
    versions: Annotated[Mapping[str, str], key("of Python and of the packages that are installed")]
    platform: Annotated[str, key("of the machine")]
    git_revision: Annotated[str, key("the commit; empty where it is not known")]
    git_uncommitted: Annotated[
        bool | None, key("whether files differ from that commit; null where it is not known")
    ]
    lock_sha256: Annotated[str, key("of requirements.lock; empty where there is none")]
    trials: Annotated[
        tuple[Mapping[str, Any], ...],
        key(
            "as planned, in order",
            expected="trials, each with its number from 1, `trial`, and its `phase`",
            reads=plain,
            holds=_in_order,
        ),
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        if sha256_of_values(self.study) != self.study_sha256:
            raise InputError(
                "expected the study of the stated study_sha256 in the manifest, got another than "
                f"{shown(self.study_sha256)}; {self.ADVICE}."
            )

    def files(self, data_folder: str | Path) -> SessionFiles:
        """Where the files of the session are in a data set."""
        root = Path(data_folder)
        return SessionFiles(root=root, task=self.task, subject=self.subject, session=self.session)

    @cached_property
    def values(self) -> dict[str, Any]:
        """All of it as JSON holds it."""
        return self.to_dict()

    @property
    def simulated(self) -> bool:
        """Whether the participant, the rig or both were simulated."""
        return self.simulated_participant or self.simulated_rig
