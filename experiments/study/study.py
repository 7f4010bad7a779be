"""The study file: textures, trays, models, participants, schedules and circumstances.

docs/study-file.md lists its keys; docs/method/protocols.md says what becomes of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from tactileq.experiments.study.publication import PublicationSection
from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.task_plan import (
    PAPER_PLANS,
    REPEATS,
    TaskPlan,
    check_plan,
    with_catch_trials,
)
from tactileq.experiments.study.wall import WallSection
from tactileq.modeling import InputError
from tactileq.modeling.checks import check_keys
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.claims import RATINGS, WITHDRAWN, ClaimSection, PlanSection
from tactileq.modeling.files.described import DescribedFile, FileSection, key
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.kinds import Label, ListedLabel, is_different, is_label, is_line
from tactileq.modeling.reprs import one_line
from tactileq.rig.shared.setup.sections import CALIBRATION_DAYS

# Their order is part of every seed: new ones go to the end.
TASKS = tuple(dict.fromkeys(("absolute", "relative", "oddity", "threshold", *ANSWER_TABLES)))
MOST_TEXTURES = 12
MOST_MODELS = 6
LONGEST_GAP_MIN = 30.0
# Fewer people say too little about the spread between people, on which the model's rule rests.
FEWEST_OF_MODEL = 8
TWO_MODELS = {"full": "models", "simplified": "simplified"}
SHIPPED_STUDY = Path(__file__).with_name("study.toml")


def asks_the_model(plan: PlanSection, claim: ClaimSection) -> bool:
    """Whether the model of the participants decides a claim: one about ratings, by its rule."""
    return plan.rule == WITHDRAWN or (plan.rule != "tests" and claim.measure in RATINGS)


Language = Annotated[str, key(pattern="^[a-z]{2,3}$", holds=is_line)]
TextsFile = Annotated[str, key(pattern=r"(^|/)[a-z]{2,3}\.\w+$")]


def _by_language(texts: object) -> object:
    """One file, whose name says its language, as a table of one; all else as it is."""
    return {Path(texts).stem: texts} if isinstance(texts, str) else texts


def _is_version(text: str) -> bool:
    return text == "" or is_label(text)


def _are_trays(trays: Mapping[str, str]) -> bool:
    return is_different(list(trays.values())) and not set("".join(trays.values())) & set('"\\')


@dataclass(frozen=True, kw_only=True)
class Consent(FileSection):
    """The page of consent, which is shown first."""

    WHERE: ClassVar[str] = "[consent]"
    version: Annotated[
        str,
        key(
            "of the page; without it there is none",
            expected="printable text in one line",
            advice="put it in quotes",
            holds=_is_version,
        ),
    ] = ""


@dataclass(frozen=True, kw_only=True)
class Study(DescribedFile):
    """Everything that fixes the order of all trials, and what is stated about the circumstances.

    Raises
    ------
    InputError
        For values out of range, and for names that a table could not hold.
    """

    WHAT: ClassVar[str] = "a study file"
    OPTIONAL: ClassVar[frozenset[str]] = frozenset({"publication", "wall"})
    name: Annotated[Label, key("title of the study")]
    seed: Annotated[
        int,
        key(
            "of all orders and shuffles",
            expected="a whole number from 0 to 2⁶³ − 1",
            ge=0,
            le=2**63 - 1,
        ),
    ]
    textures: Annotated[
        tuple[ListedLabel, ...],
        key(
            "names of the surfaces",
            expected=f"a list of 2 to {MOST_TEXTURES} different textures, printable text in one "
            "line without bars, quotes and backslashes",
            advice='write ["…", "…"]',
            holds=is_different,
            min_length=2,
            max_length=MOST_TEXTURES,
        ),
    ]
    trays: Annotated[
        dict[str, Label],
        key(
            "the tray of each texture's sample; no label reveals anything to participants",
            expected="a table of texture = label of its tray, all different and printable text in "
            "one line without quotes and backslashes",
            holds=_are_trays,
        ),
    ]
    models: Annotated[
        dict[ListedLabel, Label],
        key(
            "named sets of models, relative to the file, the reference first",
            expected=f"a table of 2 to {MOST_MODELS} sets of models (name = folder or file)",
            min_length=2,
            max_length=MOST_MODELS,
        ),
    ] = field(default_factory=TWO_MODELS.copy)
    languages: Annotated[
        tuple[Language, ...],
        key(
            "of all pages; the first is the default",
            expected="a list of different languages such as en or ja",
            advice='write ["en"]',
            holds=is_different,
            min_length=1,
        ),
    ] = ("en",)
    texts: Annotated[
        Mapping[Language, Path],
        key(
            "files of your own texts by language, relative to the file: those that differ from the "
            "shipped ones, or all of another language; one file alone has the name of its "
            "language; no part of what identifies the study",
            expected='a file such as "de.toml", named by its language, or a table such as '
            '{de = "texts/de.toml"}',
            reads=_by_language,
            also=TextsFile,
        ),
    ] = field(default_factory=dict)
    consent: Annotated[Consent, key("the page of consent")] = Consent()
    questions: Annotated[tuple[Question, ...], key("what each participant is asked once")] = ()
    plan: Annotated[PlanSection, key("what is fixed before the first answer")] = field(
        default_factory=PlanSection
    )
    longest_gap_min: Annotated[
        float,
        key(
            "a session that continues after a longer gap begins with training again",
            unit="min",
            ge=0,
            le=10_080,
        ),
    ] = LONGEST_GAP_MIN
    masking: Annotated[Label, key("how the sound of the device is masked")] = "not stated"
    surface_visible: Annotated[Label, key("what participants see of the surface")] = "not stated"
    data_license: Annotated[Label, key("licence of the data")] = "not stated"
    calibration_days: Annotated[
        float, key("how old a rig's calibration may be", unit="days", ge=1, le=3650)
    ] = CALIBRATION_DAYS
    measured_force: Annotated[
        bool, key("refuses a rig whose force is assumed, such as a mouse")
    ] = False
    wall: Annotated[
        WallSection | None,
        key("what a force device renders under virtual surfaces; such a rig is then required"),
    ] = None
    publication: Annotated[
        PublicationSection | None,
        key("who is named when the data are published; no part of what identifies the study"),
    ] = None
    tasks: Annotated[
        Mapping[str, TaskPlan],
        key("those of the paper are planned as there where they are not named", tables=TASKS),
    ] = field(default_factory=dict)

    __repr__ = one_line

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_trays()
        self._check_texts()
        self._check_questions()
        if self.wall is not None:
            self.wall.check_textures(self.textures)
        self._plan_tasks()
        for claim in self.plan.claims:
            self._check_claim(claim)

    def _check_trays(self) -> None:
        if set(self.trays) != set(self.textures):
            raise InputError(
                f"expected one tray for each of {', '.join(self.textures)}, got trays for "
                f"{', '.join(self.trays) or 'none'}; give each texture its tray under [trays]."
            )

    def _check_texts(self) -> None:
        if others := [name for name in self.texts if name not in self.languages]:
            raise InputError(
                f"expected texts in a language of the study ({', '.join(self.languages)}), got "
                f"{shown(others[0])}; add it to languages, or remove its file from texts."
            )

    def _check_questions(self) -> None:
        names = [question.name for question in self.questions]
        if not is_different(names):
            raise InputError(
                f"expected different questions, got {', '.join(names)}; name each of them once."
            )
        for question in self.questions:
            question.require_texts(self.languages)

    def _plan_tasks(self) -> None:
        """Put the tasks in order, name the models of each, and refuse what cannot be planned."""
        planned = {**PAPER_PLANS, **self.tasks}
        in_order = {}
        for task in (task for task in TASKS if task in planned):
            plan = planned[task]
            named = plan.models or tuple(self.models)[:2]
            check_keys(named, tuple(self.models), where=f"the models of [{task}]")
            models = tuple(name for name in self.models if name in named)
            in_order[task] = replace(plan, models=models)
            if task == "oddity":
                in_order[task] = with_catch_trials(
                    in_order[task], rule=self.plan.rule, anchors=in_order["absolute"].anchors
                )
            check_plan(task, in_order[task], textures=self.textures)
        object.__setattr__(self, "tasks", in_order)

    def _check_claim(self, claim: ClaimSection) -> None:
        """Refuse a claim about a task or models that are not planned, or about too few people."""
        if claim.task not in self.tasks:
            raise InputError(
                f"expected a planned task ({', '.join(self.tasks)}) in the claim {claim.name}, got "
                f"{shown(claim.task)}; plan it, or correct the claim."
            )
        plan = self.tasks[claim.task]
        unknown = [name for name in claim.models if name not in plan.models]
        if unknown:
            raise InputError(
                f"expected models of [{claim.task}] ({', '.join(plan.models)}) in the claim "
                f"{claim.name}, got {shown(unknown[0])}; correct it."
            )
        if asks_the_model(self.plan, claim) and plan.participants < FEWEST_OF_MODEL:
            few = " and remove few" if self.plan.rule == WITHDRAWN else ""
            raise InputError(
                f"expected {FEWEST_OF_MODEL} participants or more in [{claim.task}] for the rule "
                f'"{self.plan.rule}" of the claim {claim.name}, got {plan.participants}; plan '
                f'{FEWEST_OF_MODEL} or more, or write rule = "tests" in [plan]{few}.'
            )

    def language_of_session(self, asked: str) -> str:
        """The language that is asked for; the first one where none is.

        Raises
        ------
        InputError
            If the study does not have it.
        """
        if asked and asked not in self.languages:
            raise InputError(
                f"expected a language of the study ({', '.join(self.languages)}), got "
                f"{shown(asked)}; choose one, or add it to the study."
            )
        return asked or self.languages[0]

    def plan_of(self, task: str) -> TaskPlan:
        """Participants, schedule, models and repeats of one task.

        Raises
        ------
        InputError
            If the study has no such task.
        """
        if task not in self.tasks:
            raise InputError(
                f"expected the task {' or '.join(self.tasks)}, got {shown(task)}; choose one, or "
                "plan it in the study file."
            )
        return self.tasks[task]

    def models_of(self, task: str) -> tuple[str, ...]:
        """The sets of models that a task compares, in the study's order.

        Raises
        ------
        InputError
            If the study has no such task.
        """
        return self.plan_of(task).models

    def sessions(self, task: str) -> int:
        """Sessions (days) per participant: by day one for each model, else 1.

        Raises
        ------
        InputError
            If the study has no such task.
        """
        plan = self.plan_of(task)
        return len(plan.models) if plan.schedule == "by-day" else 1

    def to_dict(self) -> dict[str, Any]:
        """Plain values of what fixes the experiment.

        So without the publication, and without the places of texts, which data name by their hash.
        """
        left_out = ("publication", "texts")
        return {name: value for name, value in self.to_tables().items() if name not in left_out}

    def to_tables(self) -> dict[str, Any]:
        """Plain values of the whole file."""
        return super().to_dict()

    @property
    def sha256(self) -> str:
        """SHA-256 of its values, by which files name the study that they are based on."""
        return sha256_of_values(self.to_dict())

    @classmethod
    def from_tables(cls, values: Mapping[str, Any], *, folder: Path | None = None) -> Self:
        """A study from plain values, as in a study file; repeats are the usual ones of a task."""
        usual = {
            task: {"repeats": repeats, **values[task]}
            for task, repeats in REPEATS.items()
            if isinstance(values.get(task), Mapping)
        }
        return super().from_tables({**values, **usual}, folder=folder)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The study that `to_dict` gave; refused as by `load`."""
        return cls.from_tables(values)

    @classmethod
    def load(cls, path: str | Path | None = None) -> Self:
        """Read a study file (TOML); without a path the shipped one with the paper's textures.

        Raises
        ------
        InputError
            If the file is missing, is not TOML, or holds unknown keys or values out of range.
        """
        return super().load(SHIPPED_STUDY if path is None else path)


def plan_sha256(study: Study, models_sha256: Mapping[str, Mapping[str, str]]) -> str:
    """SHA-256 of all that the page to preregister says: the study, and the models by their hashes.

    docs/method/protocols.md#plan

    Parameters
    ----------
    models_sha256 : mapping of texture to mapping of set to SHA-256
        As `ModelSets.sha256` gives them.
    """
    models = {texture: dict(hashes) for texture, hashes in models_sha256.items()}
    return sha256_of_values({"study": study.to_dict(), "models_sha256": models})
