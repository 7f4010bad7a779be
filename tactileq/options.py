"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

Out = Annotated[Path, typer.Option("--out", help="Where the results go.")]
Seed = Annotated[int, typer.Option(min=0, max=2**31, help="Seed of everything that is random.")]
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
        help="Above the threshold's table hold its last level as a lower bound, or know nothing.",
    ),
]
StudyFile = Annotated[
    Path | None, typer.Option("--study", help="Study file (TOML); the paper's design without it.")
]
StudyArgument = Annotated[Path, typer.Argument(metavar="STUDY", help="A study file (TOML).")]
Models = Annotated[
    Path | None,
    typer.Option("--models", help="Instead of the study's first models: a folder of full ones."),
]
Simplified = Annotated[
    Path | None,
    typer.Option(
        "--simplified", help="Instead of the study's second models: a folder of simplified ones."
    ),
]
SceneModels = Annotated[
    Path | None,
    typer.Option(
        "--scene",
        help="Instead of --simplified: a scene file (TOML), or a folder of tactileq scene.",
    ),
]
Data = Annotated[Path, typer.Option("--data", help="Folder of the study's answers.")]
RigPath = Annotated[Path, typer.Option("--rig", help="Rig file (TOML).")]
OptionalRigPath = Annotated[Path | None, typer.Option("--rig", help="Rig file (TOML).")]
HandKind = Annotated[
    str | None, typer.Option("--hand", help="Without --rig: tablet, mouse, serial or scripted.")
]
HandDevice = Annotated[str | None, typer.Option("--hand-device", help="Device of the hand.")]
CountsPerMm = Annotated[float | None, typer.Option("--counts-per-mm", help="Of a mouse or tablet.")]
AssumedForce = Annotated[
    float | None, typer.Option("--force", help="Force of a hand that measures none, N.")
]
