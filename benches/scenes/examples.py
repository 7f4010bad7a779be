"""The shipped scenes, compiled: reduction of cost and the loss, compared with an AR model.

Losses are relative to the true surface, which no model knows, at all conditions of the scene, in
the band of its actuator: the losses of the full model are those of the fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import NamedTuple

import numpy as np
import pandas as pd

from tactileq.analysis.columns import SIMULATED_COLUMN
from tactileq.analysis.page.sections import Mapped
from tactileq.analysis.textures.between import RIVAL_ORDER, Truth
from tactileq.benches.chart.rival_costs import coefficients_cost
from tactileq.benches.rendering.coefficients import CoefficientTable, tabled_predictor
from tactileq.modeling import ARModel, CompiledScene, Scene, TextureModel, fit_texture
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.fitting.autoregressive import fit_ar
from tactileq.modeling.rendering.cost import Cost
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.compiler import compile_scenes
from tactileq.modeling.scenes.cost import stored_numbers
from tactileq.modeling.scenes.measures import ComparedBand, Errors, errors_between
from tactileq.modeling.scenes.places import Places, enclosing, places_of
from tactileq.modeling.scenes.strokes import Windows, windows_kept
from tactileq.stimuli.planted.drawn import draw_surface

PLANTED_EXAMPLES = (
    *("full_range", "slow_light_touch", "vibrator_40_400_hz", "microcontroller_64_kb"),
)
DEMO_EXAMPLES = PLANTED_EXAMPLES[:-1]  # to whose models 64 kB is no limit
DRAWN_EXAMPLE = "drawn_surfaces"
DRAWN_SEEDS = (1000, 1001)
WINDOWS = 20
FULL_MODEL, LEAST, RIVAL = "full model", "least model", f"AR({RIVAL_ORDER})"
SCENE_COMPARISON_COLUMNS = (
    Column("scene", is_name=True),
    Column("method", is_name=True),
    Column("numbers"),
    Column("bytes"),
    Column("operations", "operations per sample", format=".1f"),
    Column("fewer_numbers", "numbers, full model over this", format=".1f"),
    Column("fewer_operations", "operations, full model over this", format=".1f"),
    Column("gfc30", "GFC30 relative to the truth, mean", format=".3f"),
    Column("gfc30_worst", "worst", format=".3f"),
    Column("bands_db", "error in nine bands, RMS", "dB", format=".2f"),
    Column("bands_db_worst", "worst", "dB", format=".2f"),
    Column("level_db", "level error, RMS", "dB", format=".2f"),
    Column("level_db_worst", "worst", "dB", format=".2f"),
    Column("windows", "1 s windows", is_name=True),
    SIMULATED_COLUMN,
)


@dataclass(frozen=True, eq=False)
class Surface:
    """What a texture's models are judged by: its truth, and the rival fitted to its recordings."""

    truth: Truth
    rival: ARModel


class CompiledExample(NamedTuple):
    """A scene as it was compiled, and for each texture how many windows of 1 s kept its bound."""

    compiled: CompiledScene
    windows: tuple[Windows, ...]


def example(name: str) -> Scene:
    """One of the scenes that ship."""
    file = resources.files("tactileq.modeling.scenes") / "shipped" / f"{name}.toml"
    with resources.as_file(file) as path:
        return Scene.load(path)


def compile_examples(
    models: Mapping[str, TextureModel], which: Sequence[str] = PLANTED_EXAMPLES
) -> list[CompiledExample]:
    """Shipped scenes, compiled from models by the name of their texture, and tried by strokes."""
    found = compile_scenes([example(name) for name in which], models)
    return [
        CompiledExample(
            compiled,
            tuple(
                windows_kept(texture, compiled.scene, count=WINDOWS)
                for texture in compiled.textures
            ),
        )
        for compiled in found
    ]


def drawn_example(
    seeds: Sequence[int] = DRAWN_SEEDS,
) -> tuple[CompiledExample, dict[str, Surface]]:
    """The scene of drawn surfaces, from 1 s of each condition, and what they are judged by."""
    models, surfaces = {}, {}
    for seed in seeds:
        surface = draw_surface(seed)
        records = surface.record(seed=seed)
        models[surface.name] = fit_texture(records)
        surfaces[surface.name] = Surface(surface, fit_ar(records, order=RIVAL_ORDER))
    return compile_examples(models, [DRAWN_EXAMPLE])[0], surfaces


def comparison_table(
    examples: Sequence[tuple[CompiledExample, Mapping[str, Surface]]], *, mapped: Mapped = map
) -> pd.DataFrame:
    """Full models, least ones and the rival in each scene; `mapped` goes through the scenes.

    Numbers and bytes are those of all textures together (bytes of the least models with what they
    share counted once), operations those of the texture that takes most. The rival has its
    conditions within the scene, double precision, and the update interval of the least model.

    Returns
    -------
    DataFrame
        The columns of `SCENE_COMPARISON_COLUMNS`, three rows per scene.
    """
    rows = [row for of_scene in mapped(_rows, examples) for row in of_scene]
    return pd.DataFrame(rows)[names(SCENE_COMPARISON_COLUMNS)]


def _rows(example: tuple[CompiledExample, Mapping[str, Surface]]) -> list[dict[str, object]]:
    one, surfaces = example
    compiled = one.compiled
    judged = [
        _judged(texture, compiled.scene, surfaces[texture.texture]) for texture in compiled.textures
    ]
    costs = {
        FULL_MODEL: (
            sum(stored_numbers(texture.full) for texture in compiled.textures),
            compiled.bytes_before,
            compiled.operations_before,
        ),
        LEAST: (
            sum(stored_numbers(texture.model) for texture in compiled.textures),
            compiled.bytes_after,
            compiled.operations_after,
        ),
        RIVAL: _rival_costs(compiled, surfaces),
    }
    kept, count = (sum(windows[i] for windows in one.windows) for i in (0, 1))
    simulated = any(texture.full.simulated for texture in compiled.textures)
    rows = []
    for method, (numbers, size, operations) in costs.items():
        rows.append(
            {
                "scene": compiled.scene.name,
                "method": method,
                "numbers": numbers,
                "bytes": size,
                "operations": operations,
                "fewer_numbers": costs[FULL_MODEL][0] / numbers,
                "fewer_operations": costs[FULL_MODEL][2] / operations,
                **_summary([each[method] for each in judged]),
                "windows": f"{kept:.0f} of {count:.0f}" if method == LEAST else "n/a",
                "simulated": simulated,
            }
        )
    return rows


def _rival_costs(
    compiled: CompiledScene, surfaces: Mapping[str, Surface]
) -> tuple[int, int, float]:
    costs: list[Cost] = []
    numbers = 0
    for texture in compiled.textures:
        rival = surfaces[texture.texture].rival
        places = places_of(texture.full, compiled.scene.hand)
        numbers += _nodes_within(places, rival) * rival.n_parameters
        costs.append(
            coefficients_cost(
                rival.order,
                0,
                nodes=_nodes_within(places, tabled_predictor(rival)),
                update_samples=texture.plan.update_samples,
                single=False,
            )
        )
    size = sum(cost.table_bytes for cost in costs) + max(cost.state_bytes for cost in costs)
    return numbers, size, max(cost.operations for cost in costs)


def _nodes_within(places: Places, model: ARModel | CoefficientTable) -> int:
    """How many nodes of a grid a hand needs."""
    axes = (model.speeds_mm_s, places.speed_range), (model.forces_n, places.force_range)
    return int(np.prod([enclosing(*axis).sum() for axis in axes]))


def _judged(texture: CompiledTexture, scene: Scene, surface: Surface) -> dict[str, Errors]:
    """Errors of each method against the truth, at the places of the scene that count."""
    places = places_of(texture.full, scene.hand)
    yardstick = ComparedBand.of(texture.full, band_hz=scene.actuator.band_hz)
    speed, force = places.visited
    conditions = list(zip(speed.tolist(), force.tolist(), strict=True))
    truth = yardstick.features_of(
        np.array(
            [
                surface.truth.magnitude(yardstick.frequency_hz, speed_mm_s=v, force_n=f)
                for v, f in conditions
            ]
        )
    )
    rival = [surface.rival.filter(v, f).response(yardstick.frequency_hz) for v, f in conditions]
    features = {
        FULL_MODEL: yardstick.features(texture.full.parameters(speed, force)),
        LEAST: yardstick.features(texture.model.parameters(speed, force)),
        RIVAL: yardstick.features_of(np.array(rival)),
    }
    return {method: errors_between(found, truth) for method, found in features.items()}


def _summary(errors: Sequence[Errors]) -> dict[str, float]:
    """Over all places of all textures alike."""
    every = Errors(*(np.concatenate(parts) for parts in zip(*errors, strict=True)))
    return {
        "gfc30": float(every.gfc30.mean()),
        "gfc30_worst": float(every.gfc30.min()),
        "bands_db": float(np.sqrt(np.mean(every.bands_db**2))),
        "bands_db_worst": float(every.bands_db.max()),
        "level_db": float(np.sqrt(np.mean(every.level_db**2))),
        "level_db_worst": float(every.level_db.max()),
    }
