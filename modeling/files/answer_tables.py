"""The tables of answers and of participants: experiments write them, analysis reads them.

A task exists once its table stands in `ANSWER_TABLES`; what is presented and asked in it is in
`tactileq.experiments.tasks`, in a module of the task's name. What the report says of it follows
from the table (docs/own-protocol.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan, nan

from tactileq.modeling.files.columns import Column

ENDS = (0.0, 100.0)  # of every scale that people rate on


@dataclass(frozen=True, kw_only=True)
class AnswerColumn(Column):
    """One column of a table of answers; text without `limits`.

    One that is `optional` is not stored where no row of a session has it.

    Parameters
    ----------
    right : str
        Of a column `answer` beside one that is called `correct`: the column that holds the right
        answer.
    scale : str
        Of a column of ratings, whose `limits` are then `ENDS`: the similarity of what is rated.
    """

    right: str = "texture"
    scale: str = ""

    def __post_init__(self) -> None:
        if self.scale and self.limits != ENDS:
            raise ValueError(f"expected the limits {ENDS} of the scale {self.name}; correct them.")


YES_NO = {"1": "yes", "0": "no"}


@dataclass(frozen=True, kw_only=True)
class AnswerTable:
    """The answers to one task: their columns, and what a report has to know of them.

    Parameters
    ----------
    title : str
        The task in words that can stand after "the", such as "forced choice".
    of_surfaces : bool
        Whether every trial has a texture and a model; else nothing compares models.
    both_models : bool
        Whether every trial holds both models, so that the share of right answers is compared with
        chance, not that of one model with that of the other.
    chance : float
        Proportion correct of a participant who guesses, between 0 and 1; NaN where it is not
        known.
    alternatives : str
        The column that lists what could be answered, separated by |, as many in each trial;
        chance is one over their number.
    models_in : str
        The column that lists the models of a trial that holds both, separated by |; without it
        all trials hold the two that the task compares.
    other_texture : str
        The column that names another texture than `texture` in trials that show whether people
        tell surfaces apart (anchors, catch trials), and the same one elsewhere. Such trials stand
        apart from the answers about models.
    """

    title: str
    columns: tuple[AnswerColumn, ...]
    of_surfaces: bool = True
    both_models: bool = False
    chance: float = nan
    alternatives: str = ""
    models_in: str = ""
    other_texture: str = ""

    def __post_init__(self) -> None:
        names = [column.name for column in self.columns]
        if not (isnan(self.chance) or 0 < self.chance < 1):
            raise ValueError(f"expected a chance between 0 and 1, got {self.chance}; correct it.")
        for listed in (self.alternatives, self.models_in, self.other_texture):
            if listed and listed not in names:
                raise ValueError(
                    f"expected a column of the {self.title} that says what a trial holds, got "
                    f"{listed!r}; name one of {', '.join(names)}."
                )
        if self.alternatives and not isnan(self.chance):
            raise ValueError(
                f"expected a chance or alternatives in the {self.title}, got both; keep one."
            )
        if not self.both_models and self.has_chance and "correct" not in names:
            raise ValueError(
                f"expected right answers in the {self.title}, whose chance is declared, got no "
                "column correct; declare it."
            )
        if self.both_models and (isnan(self.chance) or self.measures != ("correct",)):
            raise ValueError(
                f"expected right answers and their chance in the {self.title}, whose trials hold "
                "both models, so that nothing else can be claimed; declare them."
            )

    @property
    def measures(self) -> tuple[str, ...]:
        """The columns that claims can be about: ratings, and whether the answer is right.

        None where nothing compares models.
        """
        if not self.of_surfaces:
            return ()
        return tuple(c.name for c in self.columns if c.scale or c.name == "correct")

    @property
    def scales(self) -> tuple[str, ...]:
        """The measures that are ratings on a scale of similarity."""
        return tuple(name for name in self.measures if name != "correct")

    @property
    def has_rates(self) -> bool:
        """Whether each model has a share of right answers: each trial has one of the models."""
        return "correct" in self.measures and not self.both_models

    @property
    def has_chance(self) -> bool:
        """Whether the rate of a participant who guesses is known."""
        return bool(self.alternatives) or not isnan(self.chance)

    @property
    def is_identification(self) -> bool:
        """Whether a trial asks which of several listed textures the one presented is."""
        asked = any(c.name == "answer" and c.right == "texture" for c in self.columns)
        return self.has_rates and bool(self.alternatives) and asked

    @property
    def is_timed(self) -> bool:
        """Whether right answers to surfaces have a response time."""
        return "correct" in self.measures and any(
            c.name == RESPONSE_TIME.name for c in self.columns
        )


def answer_table(
    *own: AnswerColumn,
    title: str,
    texture: str,
    model: str,
    of_surfaces: bool = True,
    both_models: bool = False,
    chance: float = nan,
    alternatives: str = "",
    models_in: str = "",
    other_texture: str = "",
) -> AnswerTable:
    """The table of a task: the columns of every task, with its own among them.

    Parameters
    ----------
    own : AnswerColumn
        What only this task has.
    texture, model : str
        What these two columns mean in it.
    title, of_surfaces, both_models, chance, alternatives, models_in, other_texture
        As in `AnswerTable`.
    """
    return AnswerTable(
        title=title,
        columns=_with_common_columns(*own, texture=texture, model=model, of_surfaces=of_surfaces),
        of_surfaces=of_surfaces,
        both_models=both_models,
        chance=chance,
        alternatives=alternatives,
        models_in=models_in,
        other_texture=other_texture,
    )


def _with_common_columns(
    *own: AnswerColumn, texture: str, model: str, of_surfaces: bool
) -> tuple[AnswerColumn, ...]:
    return (
        AnswerColumn(
            name="trial",
            description="Number in the session: for a planned trial its own, training included; "
            "for any other trial the next free number",
            limits=(0, inf),
            whole=True,
            required=True,
        ),
        AnswerColumn(
            name="phase",
            description="Part of the session",
            levels={"training": "for practice", "main": "counts"},
            required=True,
        ),
        AnswerColumn(name="texture", description=texture, required=of_surfaces),
        AnswerColumn(
            name="model",
            description=f"{model}: the name of a set of models in the study",
            required=of_surfaces,
        ),
        AnswerColumn(name="tray", description="Tray that held the sample"),
        *own,
        AnswerColumn(
            name="run",
            description="In which start of the session it was answered: 1, and one more each time "
            "that the session was resumed",
            limits=(1, inf),
            whole=True,
            required=True,
        ),
        AnswerColumn(
            name="valid",
            description="Whether the rig presented what was planned",
            levels={"1": "it did", "0": "it failed in this trial; the log says how"},
            limits=(0, 1),
            whole=True,
            required=True,
        ),
        AnswerColumn(
            name="repeats",
            description="Number of the planned trial that was presented once more, since it was "
            "not valid, or since training began again; n/a for a planned trial itself",
            limits=(1, inf),
            whole=True,
        ),
        AnswerColumn(
            name="pilot",
            description="Whether the session was a pilot, whose answers are not data of the study",
            levels={"true": "of a pilot", "false": "of the study"},
            required=True,
        ),
        AnswerColumn(
            name="simulated",
            description="Whether the participant, the rig or both were simulated",
            levels={
                "true": "simulated; SimulatedParticipant and SimulatedRig say what",
                "false": "a person at a real rig",
            },
            required=True,
        ),
    )


RESPONSE_TIME = AnswerColumn(
    name="response_time_s",
    description="From the first sample of the first presentation to the answer",
    limits=(0, inf),
    unit="s",
)

CORRECT = AnswerColumn(
    name="correct",
    description="Whether the answer is correct",
    levels=YES_NO,
    limits=(0, 1),
    whole=True,
)
PRESSES = AnswerColumn(
    name="presses",
    description="Presentations of a virtual surface, repeated ones included",
    limits=(0, inf),
    whole=True,
)

# Of participants.tsv: the first column, and those behind the answers to a study's questions.
PARTICIPANT_ID = Column("participant_id", description="Participant", required=True)
PARTICIPANT_COLUMNS = (
    Column(
        "slot",
        description="Place in the design, which determines the balanced parts of the order",
        limits=(0, inf),
        whole=True,
        optional=True,
    ),
    Column(
        "status",
        description="Whether the participant continues",
        levels={"enrolled": "takes part", "dropped": "will not come back"},
        optional=True,
    ),
    Column(
        "consent_version",
        description="Version of the consent form that was agreed to",
        optional=True,
    ),
    Column("language", description="Language of the texts", optional=True),
    Column(
        "pilot",
        description="Whether the sessions were a pilot",
        levels={"true": "a pilot", "false": "data of the study"},
        optional=True,
    ),
    Column(
        "simulated",
        description="Whether the participant was simulated",
        levels={"true": "simulated", "false": "a person"},
        required=True,
    ),
)

# In the order in which a study does them; that order is part of every seed.
ANSWER_TABLES = {
    "absolute": answer_table(
        AnswerColumn(
            name="virtual_texture",
            description="Texture that the virtual surface models: the real one's, or in an anchor "
            "another one, which was presented as the same",
            required=True,
        ),
        AnswerColumn(
            name="first_surface",
            description="Surface presented when the trial began",
            levels={"real": "real surface", "virtual": "virtual surface"},
        ),
        AnswerColumn(
            name="magnitude_similarity",
            description="Rated similarity of vibration magnitude, 0 (different) to 100 (identical)",
            limits=ENDS,
            unit="arbitrary",
            scale="vibration magnitude",
        ),
        AnswerColumn(
            name="frequency_similarity",
            description="Rated similarity of frequency pattern, 0 (different) to 100 (identical)",
            limits=ENDS,
            unit="arbitrary",
            scale="frequency pattern",
        ),
        AnswerColumn(
            name="toggles",
            description="Changes between the real and the virtual surface",
            limits=(0, inf),
            whole=True,
        ),
        RESPONSE_TIME,
        title="absolute evaluation",
        texture="Real surface",
        model="Model behind the virtual surface",
        other_texture="virtual_texture",
    ),
    "relative": answer_table(
        AnswerColumn(
            name="layout",
            description="Texture behind each button, from button 1, separated by |",
        ),
        AnswerColumn(name="answer", description="Texture of the chosen virtual surface"),
        CORRECT,
        PRESSES,
        RESPONSE_TIME,
        title="forced choice",
        texture="Real surface, which is the correct answer",
        model="Model behind all virtual surfaces of the trial",
        alternatives="layout",
    ),
    "oddity": answer_table(
        AnswerColumn(
            name="layout",
            description="Model behind each button, from button 1, separated by |",
        ),
        AnswerColumn(
            name="odd_position",
            description="Button of the odd one, from 1",
            limits=(1, 3),
            whole=True,
            required=True,
        ),
        AnswerColumn(
            name="answer",
            description="Button that was chosen, from 1",
            limits=(1, 3),
            whole=True,
            right="odd_position",
        ),
        CORRECT,
        PRESSES,
        RESPONSE_TIME,
        AnswerColumn(
            name="odd_texture",
            description="Texture that the odd one models: in a catch trial another one than the "
            "other two, else the same",
            optional=True,
        ),
        title="oddity task",
        texture="Texture that all three virtual surfaces model",
        model="Model of the odd one",
        both_models=True,
        chance=1 / 3,
        models_in="layout",
        other_texture="odd_texture",
    ),
    "threshold": answer_table(
        AnswerColumn(
            name="frequency_hz",
            description="Frequency of the sinusoid",
            limits=(0, inf),
            unit="Hz",
            required=True,
        ),
        AnswerColumn(
            name="amplitude_g",
            description="Amplitude of the sinusoid (peak)",
            limits=(0, inf),
            unit="g",
            required=True,
        ),
        AnswerColumn(
            name="highest_g",
            description="Highest amplitude (peak) that the rig could present",
            limits=(0, inf),
            unit="g",
            required=True,
        ),
        AnswerColumn(
            name="interval",
            description="Interval that held the sinusoid; the other one was silent",
            limits=(1, 2),
            whole=True,
            required=True,
        ),
        AnswerColumn(
            name="answer",
            description="Interval that was chosen",
            limits=(1, 2),
            whole=True,
            right="interval",
        ),
        CORRECT,
        RESPONSE_TIME,
        title="detection threshold",
        texture="n/a: no surface is presented",
        model="n/a: no surface is presented",
        of_surfaces=False,
        chance=1 / 2,
    ),
}
