"""The tables of answers, declared once: experiments write them, analysis reads and checks them.

A task exists once its table stands in `ANSWER_TABLES`; what is presented and asked in it is in
`experiments.tasks`, in a module of the task's name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any


@dataclass(frozen=True, kw_only=True)
class AnswerColumn:
    """One column of a table of answers.

    Parameters
    ----------
    name, description : str
    levels : mapping of value to its meaning
        The only values that a column of text may hold; any text without it.
    limits : (float, float), optional
        Least and largest value of a column of numbers; text without it.
    unit : str
    required : bool
        Whether every row has a value.
    before : str, optional
        What every row of a table holds that was written before there was this column; without it
        such a table is refused.
    """

    name: str
    description: str
    levels: Mapping[str, str] = field(default_factory=dict)
    limits: tuple[float, float] | None = None
    unit: str = ""
    required: bool = False
    before: str | None = None

    def sidecar(self) -> dict[str, Any]:
        """The column as a BIDS sidecar describes it."""
        described: dict[str, Any] = {"Description": self.description}
        if self.levels:
            described["Levels"] = dict(self.levels)
        if self.unit:
            described["Units"] = self.unit
        return described


MODEL_LEVELS = {"full": "all layers", "simplified": "without imperceptible layers"}


def answer_columns(*own: AnswerColumn, texture: str, model: str) -> tuple[AnswerColumn, ...]:
    """The columns of a task's table: those of every task, with its own among them.

    Parameters
    ----------
    own : AnswerColumn
        What only this task has.
    texture, model : str
        What these two columns mean in it.
    """
    return (
        AnswerColumn(
            name="trial",
            description="Running number in the session, training included",
            limits=(0, inf),
            required=True,
        ),
        AnswerColumn(
            name="phase",
            description="Part of the session",
            levels={"training": "for practice", "main": "counts"},
            required=True,
        ),
        AnswerColumn(name="texture", description=texture, required=True),
        AnswerColumn(
            name="model",
            description=model,
            levels=MODEL_LEVELS,
            required=True,
        ),
        AnswerColumn(name="tray", description="Tray that held the sample"),
        *own,
        AnswerColumn(
            name="valid",
            description="Whether the rig presented what was planned",
            levels={"1": "it did", "0": "it failed in this trial; the log says how"},
            limits=(0, 1),
            required=True,
            before="1",
        ),
        AnswerColumn(
            name="repeats",
            description="Of a trial that was repeated at the end of its phase, since it was not "
            "valid: its number; n/a for planned trials",
            limits=(1, inf),
            before="n/a",
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

# In the order in which a study does them; that order is part of every seed.
ANSWER_TABLES = {
    "absolute": answer_columns(
        AnswerColumn(
            name="first_surface",
            description="Surface presented when the trial began",
            levels={"real": "real surface", "virtual": "virtual surface"},
        ),
        AnswerColumn(
            name="magnitude_similarity",
            description="Rated similarity of vibration magnitude, 0 (different) to 100 (identical)",
            limits=(0, 100),
            unit="arbitrary",
        ),
        AnswerColumn(
            name="frequency_similarity",
            description="Rated similarity of frequency pattern, 0 (different) to 100 (identical)",
            limits=(0, 100),
            unit="arbitrary",
        ),
        AnswerColumn(
            name="toggles",
            description="Changes between the real and the virtual surface",
            limits=(0, inf),
        ),
        RESPONSE_TIME,
        texture="Real surface, and the texture that the virtual one models",
        model="Model behind the virtual surface",
    ),
    "relative": answer_columns(
        AnswerColumn(
            name="layout",
            description="Texture behind each button, from button 1, separated by |",
        ),
        AnswerColumn(name="answer", description="Texture of the chosen virtual surface"),
        AnswerColumn(
            name="correct",
            description="Whether the answer is the texture of the real surface",
            levels={"1": "right", "0": "wrong"},
            limits=(0, 1),
        ),
        AnswerColumn(
            name="presses",
            description="Presentations of a virtual surface, repeated ones included",
            limits=(0, inf),
        ),
        RESPONSE_TIME,
        texture="Real surface, which is the right answer",
        model="Model behind all virtual surfaces of the trial",
    ),
}
