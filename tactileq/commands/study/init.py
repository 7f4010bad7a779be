"""tactileq study init: a study file to begin with."""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Sequence
from pathlib import Path
from string import ascii_uppercase
from typing import Annotated

import typer

from tactileq.commands.study.check import loaded

HIGHEST_SEED = 2**53  # what every reader of numbers holds exactly
SCHEMA = "study.schema.json"  # which the first line of the file names, for editors


def study_init(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The study file (TOML) to write.")],
    models: Annotated[
        Path | None, typer.Option("--models", help="Folder of full models to study.")
    ] = None,
    simplified: Annotated[
        Path | None,
        typer.Option(
            "--simplified", help="Folder of simplified models; by default the one beside --models."
        ),
    ] = None,
) -> None:
    """Write a commented study file, the paper's design with a freshly drawn seed.

    With --models, its textures are those in the folder, and the file passes tactileq study check.
    study.schema.json beside it is for editors, which complete and check keys by it.

    Example: tactileq study init study.toml

    Example: tactileq study init study.toml --models models --simplified simplified
    """
    from tactileq.experiments.study.study import SHIPPED_STUDY, Study
    from tactileq.modeling.files.describing import schema_text
    from tactileq.modeling.files.places import unfinished_file

    if os.path.lexists(path):
        raise ValueError(
            f"expected a new file at {path}, got an existing one; choose another name."
        )
    if path.suffix != ".toml":
        raise ValueError(f"expected a name that ends in .toml, got {path}; rename it.")
    if simplified is not None and models is None:
        raise ValueError(
            f"expected --models beside --simplified, got {simplified} alone; name the folder of "
            "full models, too."
        )
    schema, described = path.parent / SCHEMA, schema_text(Study)
    _check_schema(schema, described)
    seed = secrets.randbelow(HIGHEST_SEED)
    shipped = SHIPPED_STUDY.read_text(encoding="utf-8")
    text = shipped.replace("\nseed = 1 ", f"\nseed = {seed} ")
    if models is None:
        _write_together(path, text, schema, described)
        print(f"study file: {path}")
        print(
            "Name your textures, trays, models and people in it, then: tactileq study check", path
        )
        return
    folders = (models, simplified or models.parent / "simplified")
    textures = _textures_in(folders)
    text = _study_with_models(text, textures, folders, beside=path.parent, seed=seed)
    with unfinished_file(path, text.encode()) as made:
        loaded(made)
    _write_together(path, text, schema, described)
    print(f"study file: {path}: {', '.join(textures)}")
    print(f"Write down your trays, anchors and people in it, then: tactileq study check {path}")


def _write_together(path: Path, text: str, schema: Path, described: str) -> None:
    """Write the study once its schema is there, which may be there without it."""
    from tactileq.modeling.files.writing import write_files

    write_files({schema: described.encode(), path: text.encode()})


def _check_schema(path: Path, described: str) -> None:
    """Refuse to replace another file than the schema that would be written."""
    from tactileq.modeling.files.reading import read_text

    if os.path.lexists(path) and read_text(path, "a schema of study files") != described:
        raise ValueError(
            f"expected no file at {path} but the schema of study files, got another one; remove it "
            "(tactileq schema study makes the schema again), or choose another folder."
        )


def _textures_in(folders: Sequence[Path]) -> list[str]:
    """The textures of the first folder, which must also be in the other one."""
    from tactileq.modeling.models.loading import load_any_models

    full, simplified = (sorted(load_any_models(folder)) for folder in folders)
    if missing := [name for name in full if name not in simplified]:
        raise ValueError(
            f"expected a model of each of {', '.join(full)} in {folders[1]}, got none of "
            f"{', '.join(missing)}; simplify {'it' if len(missing) == 1 else 'them'}, or name "
            "another folder with --simplified."
        )
    return full


def _study_with_models(
    text: str, textures: Sequence[str], folders: Sequence[Path], *, beside: Path, seed: int
) -> str:
    """The shipped study with these textures: models, trays, and no pairs of others."""
    from tactileq.experiments.study.design import fisher_yates
    from tactileq.experiments.study.study import Study
    from tactileq.modeling.seeds import generator

    full, simplified = (_as_toml(os.path.relpath(folder, beside)) for folder in folders)
    trays = fisher_yates(ascii_uppercase[: len(textures)], generator(seed))
    pairs = zip(textures, trays, strict=True)
    lines = [f"{_as_toml(name)} = {_as_toml(tray)}" for name, tray in pairs]
    changes = {
        r"(?m)^textures = .*$": f"textures = {_as_toml(list(textures))}",
        r"(?m)^full = .*$": f"full = {full}",
        r"(?m)^simplified = .*$": f"simplified = {simplified}",
        r"(?ms)^\[trays\]\n.*?\Z": "\n".join(["[trays]", *lines, ""]),
    }
    named = {name for pair in Study.load().tasks["absolute"].anchors.items() for name in pair}
    if not named <= set(textures):
        first, second = map(_as_toml, textures[:2])
        for key in ("anchors", "catch"):
            changes[rf"(?m)^(# )?{key} = .*$"] = f"# {key} = {{{first} = {second}}}"
    for pattern, replacement in changes.items():
        text = re.sub(pattern, replacement.replace("\\", r"\\"), text)
    return text


def _as_toml(value: object) -> str:
    import tomlkit

    return tomlkit.item(value).as_string()
