"""The command line: registers one file per command; rooms load when a command needs them."""

from __future__ import annotations

import sys
from importlib import import_module

import typer

from tactileq.telling import sentence_of

# The name of every command, and its file in tactileq/commands, which holds a function or a group of
# commands of that file's name; in the order of tactileq --help.
COMMANDS = {
    "record": "record",
    "model": "model",
    "simplify": "simplify",
    "stimuli": "stimuli",
    "vibrator": "vibrator",
    "session": "session",
    "simulate": "simulate",
    "analyze": "analyze",
    "demo": "demo",
    "import": "imports",
    "export": "exports",
    "bench": "bench",
}

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Record a surface, keep what a finger can feel, render it, and find out with people "
    "whether anybody can tell the difference.",
)
for name, file in COMMANDS.items():
    command = getattr(import_module(f"tactileq.commands.{file}"), file)
    if isinstance(command, typer.Typer):
        app.add_typer(command, name=name)
    else:
        app.command(name)(command)


def main() -> None:
    """Run the command line; bad input ends with one sentence and exit code 1."""
    try:
        app(standalone_mode=True)
        return
    except (ValueError, OSError, MemoryError) as error:  # InputError is a ValueError
        sentence = sentence_of(error)
    print(f"error: {sentence}", file=sys.stderr)
    raise SystemExit(1)
