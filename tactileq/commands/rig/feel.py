"""tactileq feel: models under the hand, without an experiment."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.options import Criterion, HoldAbove, ThresholdName, VibratorFile

if TYPE_CHECKING:
    from tactileq.experiments.feel.live_rig import LiveRig


def feel(
    models: Annotated[
        list[Path],
        typer.Argument(metavar="MODEL…", help="Full models: files (JSON), or folders of them."),
    ],
    rig: Annotated[
        Path | None,
        typer.Option(
            "--rig", help="Rig file (TOML); by default mouse pointer and default sound device."
        ),
    ] = None,
    simplified: Annotated[
        Path | None, typer.Option("--simplified", help="Folder of simplified models.")
    ] = None,
    threshold: ThresholdName = "codec",
    criterion: Criterion = "energy",
    hold_above: HoldAbove = True,
    vibrator: VibratorFile = None,
    fullscreen: Annotated[bool, typer.Option(help="Fill the screen.")] = False,
    screen: Annotated[int, typer.Option(help="Number of the screen, from 0.")] = 0,
) -> None:
    """Feel models under your hand, and see what is played and which layers can be felt.

    A window shows the spectrum at the hand's speed and force, each layer against the detection
    threshold, the hand's position on the model's grid, level and limits. Keys: 1–9 and arrows
    switch textures, F switches between full and simplified, Space stops and starts playing,
    M switches masking noise, Escape ends.

    Without a rig file the mouse pointer is the hand, its force is assumed, and the system's default
    sound device plays without calibration; if there is none, nothing is played. The window shows
    which of these apply.

    Example: tactileq feel models --simplified simplified --rig rig.toml

    Example: tactileq feel models/canvas.json
    """
    from tactileq.experiments.feel.textures import load_textures
    from tactileq.experiments.feel.view import FeltCriterion
    from tactileq.experiments.feel.visit import Visit
    from tactileq.experiments.feel.window import FeelWindow
    from tactileq.modeling import Threshold

    textures = load_textures(models, simplified)
    yardstick = FeltCriterion(
        threshold=Threshold.named(threshold), criterion=criterion, hold_above=hold_above
    )
    with (
        opened_rig(rig, vibrator) as felt,
        FeelWindow(
            Visit(textures, felt), yardstick, fullscreen=fullscreen, screen=screen
        ) as window,
    ):
        window.run()


def opened_rig(rig: Path | None, vibrator: Path | None) -> AbstractContextManager[LiveRig]:
    """The rig of this file, or what any computer has."""
    from tactileq.experiments.feel.opening import demonstration, desk
    from tactileq.modeling import Vibrator

    if rig is None:
        return demonstration(None if vibrator is None else Vibrator.load(vibrator))
    if vibrator is not None:
        raise ValueError(
            f"expected the vibrator in the rig file {rig}, got --vibrator beside it; name its file "
            "under [vibrator] there."
        )
    return desk(rig)
