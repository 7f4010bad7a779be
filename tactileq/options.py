"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer.core import TyperCommand

Out = Annotated[Path, typer.Option("--out", help="Folder or file for the results.")]
Seed = Annotated[int, typer.Option(min=0, max=2**31, help="Seed of all random numbers.")]
ModelFile = Annotated[Path, typer.Argument(metavar="MODEL", help="A model file (JSON).")]
VibratorFile = Annotated[
    Path | None,
    typer.Option("--vibrator", help="File from tactileq vibrator: compensate its resonance."),
]
ThresholdName = Annotated[
    str, typer.Option("--threshold", help="codec, pen-hold, mobile, or a TSV file of your own.")
]
Criterion = Annotated[
    Literal["energy", "paper-fft", "paper-gain"],
    typer.Option(help="Which amplitude is compared with the threshold."),
]
Margin = Annotated[float, typer.Option(help="How far below threshold a layer must be, in dB.")]
HoldAbove = Annotated[
    bool,
    typer.Option(
        "--hold-above/--known-only",
        help="Above the threshold's table: hold its last level as a lower bound, or treat the "
        "threshold as unknown.",
    ),
]
StudyFile = Annotated[
    Path | None, typer.Option("--study", help="Study file (TOML); by default the paper's design.")
]
StudyArgument = Annotated[Path, typer.Argument(metavar="STUDY", help="A study file (TOML).")]
Models = Annotated[
    Path | None,
    typer.Option("--models", help="Folder of full models, instead of the study's first models."),
]
Simplified = Annotated[
    Path | None,
    typer.Option(
        "--simplified", help="Folder of simplified models, instead of the study's second models."
    ),
]
SceneModels = Annotated[
    Path | None,
    typer.Option(
        "--scene",
        help="Instead of --simplified: a scene file (TOML), or a folder from tactileq scene.",
    ),
]
Data = Annotated[Path, typer.Option("--data", help="Folder of the study's answers.")]
RigPath = Annotated[Path, typer.Option("--rig", help="Rig file (TOML).")]
OptionalRigPath = Annotated[Path | None, typer.Option("--rig", help="Rig file (TOML).")]
HandKind = Annotated[
    str | None,
    typer.Option("--hand", help="Kind of hand, without --rig: tablet, mouse, serial or scripted."),
]
HandDevice = Annotated[
    str | None, typer.Option("--hand-device", help="Input device that measures the hand.")
]
CountsPerMm = Annotated[
    float | None,
    typer.Option("--counts-per-mm", help="Resolution of a mouse or tablet, in counts per mm."),
]
AssumedForce = Annotated[
    float | None,
    typer.Option("--force", help="Assumed force in N, where the device measures none."),
]


# What stands for two words after an option, which typer alone does not take repeatedly.
PAIR = "COLUMN VALUE"


def as_pair(words: Any) -> tuple[str, str]:
    """The two words of an option of metavar `PAIR`."""
    first, second = words
    return str(first), str(second)


class Command(TyperCommand):
    """A command whose options of metavar `PAIR` take two words each time."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        for param in self.params:
            if param.metavar == PAIR:
                param.nargs = 2
