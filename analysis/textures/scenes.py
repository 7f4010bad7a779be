"""Tables of a compiled scene: the result for each texture, and the effect of each step."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import pandas as pd

from tactileq.analysis.columns import SIMULATED_COLUMN, TEXTURE
from tactileq.analysis.labels import ALL_TEXTURES
from tactileq.modeling import CompiledScene
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.cost import stored_numbers

_MEASURES = (
    ("gfc30", "GFC30", ""),
    ("bands_db", "error in nine bands", "dB"),
    ("level_db", "level error", "dB"),
)
BEFORE_AFTER_COLUMNS = (
    TEXTURE,
    Column("layers_before", "layers before"),
    Column("layers_after", "after"),
    Column("numbers_before", "numbers before"),
    Column("numbers_after", "after"),
    Column("bytes_before", "bytes before"),
    Column("bytes_after", "after"),
    Column("operations_before", "operations per sample before", format=".1f"),
    Column("operations_after", "after", format=".1f"),
    Column("dropped", "layers dropped"),
    Column("driven_by", "driven by"),
    Column("update_ms", "update interval", "ms", format="g"),
    Column("precision"),
    *(
        column
        for name, label, unit in _MEASURES
        for column in (
            Column(f"{name}_bound", f"{label}, bound", unit, format="g"),
            Column(f"{name}_mean", f"{label}, mean over the hand's time", unit, format=".3f"),
            Column(f"{name}_worst", f"{label}, worst", unit, format=".3f"),
            Column(f"{name}_place", f"{label}, worst at"),
            Column(
                f"{name}_of_full", f"{label}, worst relative to the full model", unit, format=".3f"
            ),
        )
    ),
    Column("full_sha256", "SHA-256 of the full model", is_hash=True),
    Column("scene_sha256", "SHA-256 of the scene", is_hash=True),
    SIMULATED_COLUMN,
)
STEP_COLUMNS = (
    TEXTURE,
    Column("step", is_name=True),
    Column("layers"),
    Column("numbers"),
    Column("bytes"),
    Column("operations", "operations per sample", format=".1f"),
    Column("share", "share of the bound", format=".2f"),
    SIMULATED_COLUMN,
)
SHARED = "shared between textures"


def before_after_table(compiled: CompiledScene) -> pd.DataFrame:
    """The result for each texture, and for all together.

    Returns
    -------
    DataFrame
        The columns of `BEFORE_AFTER_COLUMNS`, a row per texture and one for all of them: sums, with
        shared parts counted once; operations of the most expensive texture; the worst value of
        each measure.
    """
    rows = [_row(compiled, texture) for texture in compiled.textures]
    total = {
        "texture": ALL_TEXTURES,
        **{
            f"{what}_{when}": sum(row[f"{what}_{when}"] for row in rows)
            for what in ("layers", "numbers")
            for when in ("before", "after")
        },
        "bytes_before": compiled.bytes_before,
        "bytes_after": compiled.bytes_after,
        "operations_before": compiled.operations_before,
        "operations_after": compiled.operations_after,
        "scene_sha256": compiled.scene.sha256,
        "simulated": any(row["simulated"] for row in rows),
    }
    return pd.DataFrame([*rows, total])[names(BEFORE_AFTER_COLUMNS)]


def _row(compiled: CompiledScene, texture: CompiledTexture) -> dict[str, Any]:
    plan = texture.plan
    row: dict[str, Any] = {
        "texture": texture.texture,
        "layers_before": texture.full.n_layers,
        "layers_after": texture.model.n_layers,
        "numbers_before": stored_numbers(texture.full),
        "numbers_after": stored_numbers(texture.model),
        "bytes_before": texture.before.bytes,
        "bytes_after": texture.after.bytes,
        "operations_before": texture.before.operations,
        "operations_after": texture.after.operations,
        "dropped": ", ".join(map(str, texture.dropped)) or "none",
        "driven_by": driven_by(texture),
        "update_ms": 1e3 * plan.update_samples / plan.rate_hz,
        "precision": "single" if plan.single else "double",
        "full_sha256": texture.full.sha256,
        "scene_sha256": compiled.scene.sha256,
        "simulated": texture.full.simulated,
    }
    for measured in texture.measures:
        for name, value in asdict(measured).items():
            row[f"{measured.measure}_{name}"] = value
    return row


def driven_by(texture: CompiledTexture) -> str:
    """What drives a compiled model, in words."""
    if texture.way != "grid":
        on = {"regression": "speed and force", "centroid": "the centroid"}[texture.way]
        return f"regression on {on}"
    return f"{texture.model.speeds_mm_s.size} × {texture.model.forces_n.size} conditions"


def steps_table(compiled: CompiledScene) -> pd.DataFrame:
    """The effect of each step of the compiler, each after the previous ones.

    Returns
    -------
    DataFrame
        The columns of `STEP_COLUMNS`, a row per texture and step; then of all textures together, in
        sums, with the most operations and the largest share, and last what sharing brings.
    """
    return pd.DataFrame(list(_steps(compiled)))[names(STEP_COLUMNS)]


def _steps(compiled: CompiledScene) -> Iterator[dict[str, object]]:
    simulated = any(texture.full.simulated for texture in compiled.textures)
    for texture in compiled.textures:
        for step in texture.steps:
            of = {"texture": texture.texture, "simulated": texture.full.simulated}
            yield asdict(step) | of
    every = list(zip(*(texture.steps for texture in compiled.textures), strict=True))
    for steps in every:
        driven = {step.step for step in steps}
        yield {
            "texture": ALL_TEXTURES,
            "step": driven.pop() if len(driven) == 1 else "grid thinned or regressed",
            "layers": sum(step.layers for step in steps),
            "numbers": sum(step.numbers for step in steps),
            "bytes": sum(step.bytes for step in steps),
            "operations": max(step.operations for step in steps),
            "share": max(step.share for step in steps),
            "simulated": simulated,
        }
        last = steps
    yield {
        "texture": ALL_TEXTURES,
        "step": SHARED,
        "layers": sum(step.layers for step in last),
        "numbers": sum(step.numbers for step in last),
        "bytes": compiled.bytes_after,
        "operations": compiled.operations_after,
        "share": max(step.share for step in last),
        "simulated": simulated,
    }
