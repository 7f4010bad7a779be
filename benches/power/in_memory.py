"""A study with simulated people in memory, from answers to verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tactileq.analysis.answers.responses import PlannedTask, Responses
    from tactileq.analysis.power.power import Verdict
    from tactileq.analysis.statistics.participants.posterior import Effort
    from tactileq.experiments.observers.in_memory import Row
    from tactileq.experiments.observers.percepts import Perception
    from tactileq.experiments.observers.psychometrics import Psychometrics
    from tactileq.experiments.study.models import ModelSets
    from tactileq.experiments.study.study import Study


@dataclass(frozen=True, eq=False, kw_only=True)
class SimulatedStudy:
    """A study with the simulated people who take part in it.

    Parameters
    ----------
    study : Study
        With as many participants as the largest n.
    """

    study: Study
    models: ModelSets
    perception: Perception
    psychometrics: Psychometrics

    @property
    def tasks(self) -> tuple[str, ...]:
        """Those that claims are about."""
        return tuple(dict.fromkeys(claim.task for claim in self.study.plan.claims))


def planned_for(plan: Study, sizes: Sequence[int]) -> Study:
    """The study with the largest number of participants in each task that a claim is about.

    Raises
    ------
    ValueError
        If there is no claim, a claim is about a task that compares no models, the rule of the plan
        was withdrawn, or a number of participants is too small for it or leaves the order of models
        unbalanced.
    """
    from tactileq.experiments.study.study import FEWEST_OF_MODEL, asks_the_model
    from tactileq.modeling.files.answer_tables import ANSWER_TABLES

    if not plan.plan.claims:
        raise ValueError(
            "expected claims under [[plan.claims]] in the study, whose verdicts are simulated, got "
            "none; add the study's claims (tactileq study init shows how)."
        )
    for claim in plan.plan.claims:
        if not ANSWER_TABLES[claim.task].measures:
            raise ValueError(
                f"expected claims about tasks that compare models, got {claim.name} about "
                f"{claim.task}; leave it out."
            )
    plan.plan.require_current()
    by_model = any(asks_the_model(plan.plan, claim) for claim in plan.plan.claims)
    if by_model and min(sizes) < FEWEST_OF_MODEL:
        raise ValueError(
            f"expected {FEWEST_OF_MODEL} participants or more, as the rule of the plan is "
            f'"{plan.plan.rule}", got {min(sizes)}; correct --subjects.'
        )
    tasks = {claim.task for claim in plan.plan.claims}
    for n in sizes:  # each has to be a study that can be run
        with_n = {task: replace(plan.plan_of(task), participants=n) for task in tasks}
        study = replace(plan, tasks={**plan.tasks, **with_n})
    return study


def people_of(
    study: Study,
    sets: ModelSets,
    *,
    threshold: str,
    planted: dict[str, dict[str, float]],
) -> SimulatedStudy:
    """Who takes part, with the planted textures as real surfaces.

    Raises
    ------
    ValueError
        For a texture that is not among them, and for models that are missing.
    """
    from tactileq.experiments.observers.percepts import Perception
    from tactileq.experiments.observers.psychometrics import Psychometrics
    from tactileq.experiments.observers.simulated import require_plantable
    from tactileq.modeling import Threshold
    from tactileq.stimuli.planted.textures import TEXTURES, planted_texture

    if unknown := [name for name in study.textures if name not in TEXTURES]:
        raise ValueError(
            f"expected a study of the planted textures {', '.join(TEXTURES)}, which take the place "
            f"of the real surfaces, got {', '.join(unknown)}; plan with textures of these names."
        )
    sets.require(study)
    psychometrics = Psychometrics(planted=planted)
    perception = Perception(
        study,
        real={name: planted_texture(name) for name in study.textures},
        models=sets,
        threshold=Threshold.named(threshold),
    )
    require_plantable(perception, psychometrics)
    return SimulatedStudy(
        study=study, models=sets, perception=perception, psychometrics=psychometrics
    )


def simulated_verdicts(
    people: SimulatedStudy,
    sizes: Sequence[int],
    number: int,
    *,
    seed: int,
    effort: Effort | None = None,
) -> list[Verdict]:
    """All verdicts of one simulation: the largest study, and its first n participants."""
    from tactileq.analysis.power.power import verdicts_by_size
    from tactileq.experiments.observers.in_memory import simulate_sessions
    from tactileq.modeling.seeds import generator

    rng = generator(seed, number)
    rows = simulate_sessions(
        people.study,
        models=people.models,
        perception=people.perception,
        psychometrics=people.psychometrics,
        seed=int(rng.integers(2**63)),
        subjects=range(1, max(sizes) + 1),
        tasks=people.tasks,
    )
    by_size = {n: responses_of(people, rows, n=n) for n in sizes}
    return verdicts_by_size(by_size, rng=rng, effort=effort)


def responses_of(people: SimulatedStudy, rows: dict[str, list[Row]], *, n: int) -> Responses:
    """The answers of the first n participants as if they had been loaded."""
    import pandas as pd

    from tactileq.analysis.answers.plan import plan_from
    from tactileq.analysis.answers.responses import Responses, stands_apart

    answers, anchors = {}, {}
    for task, of_task in rows.items():
        table = pd.DataFrame(of_task)
        table = table[(table["participant"] <= n) & (table["phase"] == "main")]
        table = table.assign(participant_id=table["participant"].map("sub-{:04d}".format))
        apart = stands_apart(table, task)
        answers[task], anchors[task] = table[~apart], table[apart]
    return Responses(
        answers=answers,
        simulated_participants=True,
        simulated_rig=True,
        anchors=anchors,
        equal=people.models.equal_models(people.study.textures),
        plan=plan_from(people.study.plan.to_dict(), path=Path("study")),
        planned=_planned(people, n=n),
    )


def _planned(people: SimulatedStudy, *, n: int) -> dict[str, PlannedTask]:
    from tactileq.analysis.answers.responses import PlannedTask
    from tactileq.experiments.tasks.durations import trials_of_session

    study, planned = people.study, {}
    for task in people.tasks:
        plan, sessions = study.plan_of(task), n * study.sessions(task)
        _, trials = trials_of_session(study, task)
        planned[task] = PlannedTask(n, sessions, plan.models, plan.repeats, sessions * trials)
    return planned
