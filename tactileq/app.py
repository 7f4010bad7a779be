"""The command line: registers one file per command; rooms load when a command needs them."""

from __future__ import annotations

import sys
import warnings
from contextlib import suppress
from importlib import import_module
from typing import Annotated

import typer

from tactileq.interruption import Interrupted, ended_by_signals
from tactileq.options import Command
from tactileq.printing import print_warning, sentence_of
from tactileq.workers import collect_less_often

# The name of every command, and its module in tactileq/commands, which holds a function or a group
# of commands of that module's name; in the order of tactileq --help.
COMMANDS = {
    "record": "recording.record",
    "rig": "rig.rig",
    "model": "models.model",
    "simplify": "models.simplify",
    "scene": "models.scene",
    "stimuli": "models.stimuli",
    "vibrator": "models.vibrator",
    "feel": "rig.feel",
    "study": "study.study",
    "power": "study.power",
    "session": "study.session",
    "threshold": "study.threshold",
    "simulate": "study.simulate",
    "analyze": "results.analyze",
    "verify": "results.verify",
    "publish": "results.publish",
    "demo": "benches.demo",
    "import": "recording.imports",
    "export": "models.exports",
    "bench": "benches.bench",
    "stability": "benches.stability",
    "schema": "study.schema",
}

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Record a surface, model it, keep the layers that people can feel, render it, and test in "
    "experiments whether anybody can tell the difference.",
)


def show_version(wanted: bool) -> None:
    """Print name and version, and end."""
    if wanted:
        from importlib.metadata import version

        print(f"tactileq {version('tactileq')}")
        raise typer.Exit


@app.callback()
def options(
    show: Annotated[
        bool,
        typer.Option(
            "--version", callback=show_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Options of the program itself; each acts through its callback."""


for name, module in COMMANDS.items():
    command = getattr(import_module(f"tactileq.commands.{module}"), module.split(".")[-1])
    if isinstance(command, typer.Typer):
        app.add_typer(command, name=name)
    else:
        app.command(name, cls=Command)(command)


def main() -> None:
    """Run the command line; bad input ends with one sentence and exit code 1.

    A signal that asks it to end: one sentence, and 128 + its number.
    """
    warnings.showwarning = print_warning
    collect_less_often()
    try:
        with ended_by_signals():
            app(standalone_mode=True)
        return
    except Interrupted as end:
        sentence, code = (
            f"interrupted by {end.signal_name}; no file was left half written.",
            end.code,
        )
    except (ValueError, OSError, MemoryError) as error:  # InputError is a ValueError
        sentence, code = f"error: {sentence_of(error)}", 1
    with suppress(OSError):  # the terminal may be gone
        print(sentence, file=sys.stderr)
    raise SystemExit(code)
