"""The command line: registers one file per command; rooms load when a command needs them."""

from __future__ import annotations

import sys
import warnings
from contextlib import suppress
from importlib import import_module
from typing import Annotated

import typer

from tactileq.interruption import Interrupted, ended_by_signals
from tactileq.printing import print_warning, sentence_of
from tactileq.workers import collect_less_often

# The name of every command, and its file in tactileq/commands, which holds a function or a group of
# commands of that file's name; in the order of tactileq --help.
COMMANDS = {
    "record": "record",
    "rig": "rig",
    "model": "model",
    "simplify": "simplify",
    "scene": "scene",
    "stimuli": "stimuli",
    "vibrator": "vibrator",
    "feel": "feel",
    "study": "study",
    "power": "power",
    "session": "session",
    "threshold": "threshold",
    "simulate": "simulate",
    "analyze": "analyze",
    "verify": "verify",
    "publish": "publish",
    "demo": "demo",
    "import": "imports",
    "export": "exports",
    "bench": "bench",
    "stability": "stability",
    "schema": "schema",
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


for name, file in COMMANDS.items():
    command = getattr(import_module(f"tactileq.commands.{file}"), file)
    if isinstance(command, typer.Typer):
        app.add_typer(command, name=name)
    else:
        app.command(name)(command)


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
