"""The study file: textures, trays, models, participants, schedules and circumstances.

docs/method/protocols.md
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from experiments.study.plan import Plan
from experiments.study.questions import Question
from experiments.study.tables import (
    as_list,
    as_table,
    require_bool,
    require_different,
    require_keys,
    require_label,
)
from experiments.study.task_plan import PAPER_PLANS, TaskPlan, check_plan, with_catch_trials
from modeling import InputError
from modeling.checks import check_keys, check_number, check_whole
from modeling.errors import shown
from modeling.files.answer_tables import ANSWER_TABLES
from modeling.files.documents import as_text, read_toml
from modeling.files.hashes import sha256_of_values

# Their order is part of every seed: new ones go to the end.
TASKS = tuple(dict.fromkeys(("absolute", "relative", "oddity", "threshold", *ANSWER_TABLES)))
MOST_TEXTURES = 12
MOST_MODELS = 6
CALIBRATION_DAYS = 90.0
LONGEST_GAP_MIN = 30.0
TWO_MODELS = {"full": "models", "simplified": "simplified"}
SHIPPED_STUDY = Path(__file__).with_name("study.toml")


@dataclass(frozen=True, kw_only=True)
class Study:
    """Everything that fixes the order of all trials, and what is stated about the circumstances.

    Parameters
    ----------
    name : str
    seed : int
        ≥ 0; the order of every session follows from it, the task, the subject, the session and the
        slot.
    textures : tuple of str
        2 … 12 different names.
    trays : dict of str
        For each texture the label of the tray that holds its sample; all different.
    tasks : mapping of task to TaskPlan
        Those of the paper (absolute, relative) are planned as there where they are not named.
    models : mapping of set to path
        Two or more named sets of models, relative to the study file; the first is the reference.
    languages : tuple of str
        Codes such as en; the first is the default.
    consent : str
        Version of the page of consent; empty for none.
    questions : tuple of Question
        What a participant is asked once.
    plan : Plan
        Claims and exclusions.
    longest_gap_min : float
        A session that continues after a longer gap begins with training again, minutes.
    masking : str
        How the sound of the device was masked.
    surface_visible : str
        What the participant saw of the surface.
    data_license : str
        Licence of the data, for the description of the data set.
    calibration_days : float
        How old the calibration of a rig may be, above 0.
    measured_force : bool
        Whether the rig must measure force: a mouse, of which it is assumed, is refused then.

    Raises
    ------
    InputError
        For values out of range, and for names that a table could not hold.
    """

    name: str
    seed: int
    textures: tuple[str, ...]
    trays: Mapping[str, str]
    tasks: Mapping[str, TaskPlan] = field(default_factory=dict)
    models: Mapping[str, str] = field(default_factory=lambda: dict(TWO_MODELS))
    languages: tuple[str, ...] = ("en",)
    consent: str = ""
    questions: tuple[Question, ...] = ()
    plan: Plan = field(default_factory=Plan)
    longest_gap_min: float = LONGEST_GAP_MIN
    masking: str = "not stated"
    surface_visible: str = "not stated"
    data_license: str = "not stated"
    calibration_days: float = CALIBRATION_DAYS
    measured_force: bool = False

    def __post_init__(self) -> None:
        for name in ("textures", "languages", "questions"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in ("trays", "models"):
            object.__setattr__(self, name, dict(getattr(self, name)))
        check_whole("seed", self.seed, low=0, high=2**63)
        check_number("calibration_days", self.calibration_days, low=1.0, high=3650.0)
        check_number("longest_gap_min", self.longest_gap_min, high=10_080.0)
        for name in ("calibration_days", "longest_gap_min"):
            object.__setattr__(self, name, float(getattr(self, name)))
        require_bool("measured_force", self.measured_force)
        self._check_texts()
        self._check_trays()
        self._check_models()
        self._check_questions()
        self._plan_tasks()
        self.plan.check(self.tasks)

    def _check_texts(self) -> None:
        for name in ("name", "masking", "surface_visible", "data_license"):
            require_label(name, getattr(self, name))
        if self.consent:
            require_label("the version of the consent", self.consent)
        for texture in self.textures:
            require_label("texture", texture, forbidden='|"\\')
        check_whole("number of textures", len(self.textures), low=2, high=MOST_TEXTURES)
        require_different("textures", self.textures)

    def _check_trays(self) -> None:
        if set(self.trays) != set(self.textures):
            raise InputError(
                f"expected one tray for each of {', '.join(self.textures)}, got trays for "
                f"{', '.join(self.trays) or 'none'}; give each texture its tray under [trays]."
            )
        for tray in self.trays.values():
            require_label("tray", tray, forbidden='"\\')
        require_different("trays", tuple(self.trays.values()))

    def _check_models(self) -> None:
        for name, path in self.models.items():
            require_label("a set of models", name, forbidden='|"\\')
            require_label(f"the place of the models {name}", path)
        check_whole("number of sets of models", len(self.models), low=2, high=MOST_MODELS)

    def _check_questions(self) -> None:
        for language in self.languages:
            if not (isinstance(language, str) and re.fullmatch("[a-z]{2,3}", language)):
                raise InputError(
                    f"expected languages such as en or ja, got {shown(language)}; correct it."
                )
        if not self.languages:
            raise InputError('expected one language at least, got none; write languages = ["en"].')
        require_different("languages", self.languages)
        require_different("questions", [question.name for question in self.questions])
        for question in self.questions:
            question.require_texts(self.languages)

    def _plan_tasks(self) -> None:
        """Put the tasks in order, name the models of each, and refuse what cannot be planned."""
        planned = {**PAPER_PLANS, **self.tasks}
        check_keys(planned, TASKS, where="the tasks")
        in_order = {}
        for task in (task for task in TASKS if task in planned):
            plan = planned[task]
            if not isinstance(plan, TaskPlan):
                raise InputError(
                    f"expected a TaskPlan for {task}, got {shown(plan)}; give participants and "
                    "schedule."
                )
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
        """The study as plain values, as in a study file; `Study.from_dict` makes it again."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "tasks"}
        return {
            **plain,
            "textures": list(self.textures),
            "trays": dict(self.trays),
            "models": dict(self.models),
            "languages": list(self.languages),
            "consent": {"version": self.consent},
            "questions": [question.to_dict() for question in self.questions],
            "plan": self.plan.to_dict(),
            **{task: plan.to_dict() for task, plan in self.tasks.items()},
        }

    @property
    def sha256(self) -> str:
        """SHA-256 of its values, by which files name the study that they are based on."""
        return sha256_of_values(self.to_dict())

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> Study:
        """A study from plain values, as in a study file.

        Raises
        ------
        InputError
            For unknown or missing keys, or values out of range.
        """
        settings = dict(values)
        check_keys(settings, _STUDY_KEYS, where="the study")
        require_keys(settings, ("name", "seed", "textures", "trays"), where="the study")
        tasks = {
            name: TaskPlan.from_dict(name, settings.pop(name)) for name in TASKS if name in settings
        }
        for name, example in (("trays", "texture = tray"), ("models", "name = folder")):
            if name in settings:
                settings[name] = as_table(
                    settings[name], where=f"[{name}] of {example}", example="one line for each"
                )
        for name, example in (("textures", '["…", "…"]'), ("languages", '["en"]')):
            if name in settings:
                settings[name] = as_list(settings[name], where=name, example=f"{name} = {example}")
        if "questions" in settings:
            asked = as_list(settings["questions"], where="questions", example="[[questions]]")
            settings["questions"] = tuple(map(Question.from_dict, asked))
        if "consent" in settings:
            settings["consent"] = _version(settings["consent"])
        if "plan" in settings:
            settings["plan"] = Plan.from_dict(settings["plan"])
        return Study(**settings, tasks=tasks)

    @staticmethod
    def load(path: str | Path | None = None) -> Study:
        """Read a study file (TOML); without a path the shipped one with the paper's textures.

        Raises
        ------
        InputError
            If the file is missing, is not TOML, or holds unknown keys or values out of range.
        """
        file = SHIPPED_STUDY if path is None else Path(path)
        values = read_toml(file, "a study file")
        try:
            return Study.from_dict(values)
        except InputError as error:
            raise InputError(f"{file}: {error}") from None


_STUDY_KEYS = tuple(
    key for f in fields(Study) for key in (TASKS if f.name == "tasks" else (f.name,))
)


def _version(values: object) -> str:
    table = as_table(values, where="[consent]", example='version = "…" under [consent]')
    check_keys(table, ("version",), where="[consent]")
    return as_text(table.get("version", ""), "version in [consent]")


def plan_sha256(study: Study, models_sha256: Mapping[str, Mapping[str, str]]) -> str:
    """SHA-256 of all that the page to preregister says: the study, and the models by their hashes.

    docs/method/protocols.md#plan

    Parameters
    ----------
    study : Study
    models_sha256 : mapping of texture to mapping of set to SHA-256
        As `ModelSets.sha256` gives them.
    """
    models = {texture: dict(hashes) for texture, hashes in models_sha256.items()}
    return sha256_of_values({"study": study.to_dict(), "models_sha256": models})
