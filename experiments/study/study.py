"""The study file: textures, trays, participants, schedules and circumstances.

docs/method/protocols.md
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

from modeling import InputError
from modeling.checks import check_keys, check_number, check_whole
from modeling.errors import shown
from modeling.files.answer_tables import ANSWER_TABLES
from modeling.files.documents import read_toml
from modeling.files.hashes import sha256_of_values

Schedule = Literal["by-day", "interleaved"]

TASKS = tuple(ANSWER_TABLES)
SCHEDULES: tuple[Schedule, ...] = ("by-day", "interleaved")
MOST_TEXTURES = 12
CALIBRATION_DAYS = 90.0
_SINCE: dict[str, object] = {"calibration_days": CALIBRATION_DAYS, "measured_force": False}
SHIPPED_STUDY = Path(__file__).with_name("study.toml")


def _require_label(name: str, value: object, *, forbidden: str) -> None:
    if (
        not isinstance(value, str)
        or value.strip() != value
        or value in ("", "n/a")
        or not value.isprintable()
        or any(character in value for character in forbidden)
    ):
        listed = f" and none of {' '.join(forbidden)}" if forbidden else ""
        raise InputError(
            f"expected printable text for {name}, without tabs, line ends or spaces around it"
            f"{listed}, got {shown(value)}; rename it."
        )


@dataclass(frozen=True, kw_only=True)
class TaskPlan:
    """How many people do a task, and how the two models are spread over their days.

    Parameters
    ----------
    participants : int
        At least 1; even where the schedule is by day, so that the order of the models is
        counterbalanced exactly.
    schedule : {"by-day", "interleaved"}
        Either the two models on two days (two sessions), or mixed at random in one session.

    Raises
    ------
    InputError
        For any other value.
    """

    participants: int
    schedule: Schedule

    def __post_init__(self) -> None:
        check_whole("participants", self.participants, low=1, high=9999)
        if self.schedule not in SCHEDULES:
            raise InputError(
                f"expected a schedule of {' or '.join(SCHEDULES)}, got {shown(self.schedule)}; "
                "choose one of the two."
            )
        if self.schedule == "by-day" and self.participants % 2:
            raise InputError(
                "expected an even number of participants for the schedule by-day, got "
                f"{self.participants}; add or leave out one, so that half begin with each model."
            )

    @property
    def sessions(self) -> int:
        """Sessions (days) per participant: 2 by day, 1 interleaved."""
        return 2 if self.schedule == "by-day" else 1


PAPER_PLANS = {
    "absolute": TaskPlan(participants=20, schedule="interleaved"),
    "relative": TaskPlan(participants=24, schedule="by-day"),
}


@dataclass(frozen=True, kw_only=True)
class Study:
    """Everything that fixes the order of all trials, and what is told about the circumstances.

    Parameters
    ----------
    name : str
    seed : int
        ≥ 0; the order of every session follows from it, the task, the subject and the session.
    textures : tuple of str
        2 … 12 different names.
    trays : dict of str
        For each texture the label of the tray that holds its sample; all different.
    repeats : int
        Presentations of each texture and model in the relative task, ≥ 1.
    training_trials : int
        Trials before the main ones in each session, from 0 to the number of textures.
    tasks : mapping of task to TaskPlan
        Those of the paper (absolute, relative) are planned as there where they are not named.
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
    repeats: int = 3
    training_trials: int = 2
    tasks: Mapping[str, TaskPlan] = field(default_factory=dict)
    masking: str = "not stated"
    surface_visible: str = "not stated"
    data_license: str = "not stated"
    calibration_days: float = CALIBRATION_DAYS
    measured_force: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "textures", tuple(self.textures))
        object.__setattr__(self, "trays", dict(self.trays))
        planned = {**PAPER_PLANS, **self.tasks}
        check_keys(planned, TASKS, where="the tasks")
        for task, plan in planned.items():
            if not isinstance(plan, TaskPlan):
                raise InputError(
                    f"expected a TaskPlan for {task}, got {shown(plan)}; give participants and "
                    "schedule."
                )
        in_order = {task: planned[task] for task in TASKS if task in planned}
        object.__setattr__(self, "tasks", in_order)
        check_whole("seed", self.seed, low=0, high=2**63)
        check_whole("repeats", self.repeats, low=1, high=100)
        check_number("calibration_days", self.calibration_days, low=1.0, high=3650.0)
        object.__setattr__(self, "calibration_days", float(self.calibration_days))
        if not isinstance(self.measured_force, bool):
            raise InputError(
                f"expected true or false for measured_force, got {shown(self.measured_force)}; "
                "correct it."
            )
        self._check_texts()
        self._check_trays()
        check_whole("training_trials", self.training_trials, low=0, high=len(self.textures))

    def _check_texts(self) -> None:
        for name in ("name", "masking", "surface_visible", "data_license"):
            _require_label(name, getattr(self, name), forbidden="")
        for texture in self.textures:
            _require_label("texture", texture, forbidden='|"\\')
        check_whole("number of textures", len(self.textures), low=2, high=MOST_TEXTURES)
        if len(set(self.textures)) != len(self.textures):
            raise InputError(
                f"expected different textures, got {', '.join(self.textures)}; "
                "name each texture once."
            )

    def _check_trays(self) -> None:
        if set(self.trays) != set(self.textures):
            raise InputError(
                f"expected one tray for each of {', '.join(self.textures)}, got trays for "
                f"{', '.join(self.trays) or 'none'}; give each texture its tray under [trays]."
            )
        for tray in self.trays.values():
            _require_label("tray", tray, forbidden='"\\')
        if len(set(self.trays.values())) != len(self.trays):
            raise InputError(
                f"expected different trays, got {', '.join(self.trays.values())}; "
                "put each sample into a tray of its own."
            )

    def plan(self, task: str) -> TaskPlan:
        """Participants and schedule of one task.

        Raises
        ------
        InputError
            If the study has no such task.
        """
        if task not in self.tasks:
            raise InputError(
                f"expected the task {' or '.join(self.tasks)}, got {shown(task)}; choose one."
            )
        return self.tasks[task]

    @property
    def absolute(self) -> TaskPlan:
        """The plan of the absolute task."""
        return self.tasks["absolute"]

    @property
    def relative(self) -> TaskPlan:
        """The plan of the relative task."""
        return self.tasks["relative"]

    def to_dict(self) -> dict[str, Any]:
        """The study as plain values; `Study.from_dict` makes it again."""
        values: dict[str, Any] = {}
        for name, value in asdict(self).items():
            values |= value if name == "tasks" else {name: value}
        # Studies from before there were these keep their hash.
        return {name: value for name, value in values.items() if value != _SINCE.get(name)}

    @property
    def sha256(self) -> str:
        """SHA-256 of its values, by which files name the study that they rest on."""
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
        _require(settings, {"name", "seed", "textures", "trays"}, "the study")
        tasks = {name: _task_plan(name, settings.pop(name)) for name in TASKS if name in settings}
        if not isinstance(settings.get("trays", {}), Mapping):
            raise InputError(
                f"expected a table [trays] of texture = tray, got {shown(settings['trays'])}; "
                "write one line per texture under [trays]."
            )
        if not isinstance(settings.get("textures", []), list | tuple):
            raise InputError(
                f"expected a list of textures, got {shown(settings['textures'])}; "
                'write textures = ["…", "…"].'
            )
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


def _task_plan(task: str, values: object) -> TaskPlan:
    if not isinstance(values, Mapping):
        raise InputError(
            f"expected a table [{task}] with participants and schedule, got {shown(values)}; "
            "write both under that heading."
        )
    known = tuple(f.name for f in fields(TaskPlan))
    check_keys(values, known, where=f"[{task}]")
    _require(values, set(known), f"[{task}]")
    return TaskPlan(**values)


def _require(values: Mapping[str, Any], needed: set[str], where: str) -> None:
    missing = sorted(needed - set(values))
    if missing:
        raise InputError(
            f"expected {', '.join(sorted(needed))} in {where}, got no {', '.join(missing)}; "
            "add what is missing."
        )
