"""The least model: exhaustive search on small scenes, order by scene and bound, limits, budgets."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import InputError, RegressedModel, TextureModel, regressed
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.perception.signs_of_rest import with_signs_chosen_again
from tactileq.modeling.rendering.plan import plan_for
from tactileq.modeling.scenes.compiled import CompiledTexture
from tactileq.modeling.scenes.compiler import compile_scene
from tactileq.modeling.scenes.error_maps import ErrorMaps
from tactileq.modeling.scenes.hands import HandRange
from tactileq.modeling.scenes.limit_losses import clipped_loss_db
from tactileq.modeling.scenes.measures import ComparedBand, Errors, errors_between
from tactileq.modeling.scenes.places import places_of
from tactileq.modeling.scenes.scene import Actuator, Bound, Budget, Scene
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
SceneMaker = Callable[..., Scene]
Compile = Callable[[TextureModel, Scene], CompiledTexture]
Key = tuple[float, int, int]
INTERVALS_MS = (16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25)


# --- Everything that may become of a texture, with no search


def subsets(size: int) -> Iterator[tuple[int, ...]]:
    """All that are not empty, rising."""
    for count in range(1, size + 1):
        yield from combinations(range(size), count)


def may_stay_alone(full: TextureModel, scene: Scene, places: Any) -> Iterator[tuple[int, ...]]:
    """Choices of layers without which the power changes by less than the threshold."""
    rows, columns = np.nonzero(places.counts)
    at = full.parameters(places.speeds_mm_s[rows], places.forces_n[columns])
    frequency = np.arange(0.5, full.rate_hz / 2)  # every hertz
    low, high = scene.actuator.band_hz or (0.0, np.inf)
    threshold = np.where(
        (frequency >= low) & (frequency <= high), scene.threshold.held(frequency), np.nan
    )
    fills = own_peaks(full).fills
    for kept in subsets(full.n_layers):
        signs = np.zeros(full.n_layers)
        chosen = with_signs_chosen_again(full, list(kept))
        signs[list(kept)] = np.sign(chosen.gains.sum(axis=(0, 1)))
        torn = any(p >= 0 and (i in kept) != (p in kept) for i, p in enumerate(fills))
        rest = at._replace(gains=np.abs(at.gains) * signs)
        change = np.abs(powers(at, frequency, full.rate_hz) - powers(rest, frequency, full.rate_hz))
        felt = 2 * np.nansum(change / threshold**2, axis=1) / (full.rate_hz / 2)
        if not torn and (felt < 1).all():
            yield kept


def powers(at: Parameters, frequency_hz: Floats, rate_hz: float) -> Floats:
    """|G_w + Σ G_i H_i|² at n places, (n, f)."""
    found = []
    for noise, centres, widths, gains in zip(*at, strict=True):
        bands = band_response(
            frequency_hz, centres_hz=centres, bandwidths_hz=widths, rate_hz=rate_hz
        )
        found.append(np.abs(noise + gains @ bands) ** 2)
    return np.array(found)


def felt_of(full: TextureModel, kept: tuple[int, ...]) -> TextureModel:
    """These layers alone, blended linearly between the nodes of the full model's table."""
    linear = full
    if full.blending == "logarithmic":
        table = full.table
        linear = on_grid(full, (table.speeds_mm_s, table.forces_n), table.values)
        # What is only filled in between must not count twice in a regression.
        conditions = np.isin(table.speeds_mm_s, full.speeds_mm_s)[:, None]
        conditions = conditions & np.isin(table.forces_n, full.forces_n)
        linear = replace(linear, interpolated=~conditions)
    fewer = linear.with_layers(list(kept))
    signs = np.sign(with_signs_chosen_again(full, list(kept)).gains.sum(axis=(0, 1)))
    return replace(fewer, gains=np.abs(fewer.gains) * signs)


def on_grid(model: TextureModel, axes: tuple[Floats, Floats], values: Floats) -> TextureModel:
    """A model that blends these values (S, F, 1 + 3m) linearly."""
    noise, *others = np.split(values, 1 + np.arange(3) * model.n_layers, axis=-1)
    names = ("frequencies_hz", "bandwidths_hz", "gains")
    return replace(
        model,
        speeds_mm_s=axes[0],
        forces_n=axes[1],
        noise_gains=noise[..., 0],
        **dict(zip(names, others, strict=True)),
        level_sd_db=np.zeros(others[0].shape),
        inherited=[],
        unresolved=[],
        interpolated=[],
        blending="linear",
    )


def within_range(axis: Floats, ends: tuple[float, float]) -> Floats:
    inside = [value for value in axis if ends[0] < value < ends[1]]
    return np.array(sorted({ends[0], *inside, ends[1]}))


def blended(values: Floats, nodes: tuple[Floats, Floats], at: tuple[Floats, Floats]) -> Floats:
    """Values (S, F, k) over nodes, read along each axis by numpy's linear interpolation."""
    for axis in (0, 1):
        unit = np.eye(nodes[axis].size)
        weights = np.array([np.interp(at[axis], nodes[axis], row) for row in unit])
        values = np.moveaxis(np.tensordot(weights.T, values, (1, axis)), 0, axis)
    return values


class Driven(NamedTuple):
    model: TextureModel | RegressedModel
    at_rest: Errors  # at the places that count


def every_grid(felt: TextureModel, scene: Scene, yardstick: ComparedBand) -> Iterator[Driven]:
    """Each choice of the table's speeds and forces that encloses the scene."""
    assert isinstance(scene.hand, HandRange)
    ends = scene.hand.speed_mm_s, scene.hand.force_n
    places = places_of(felt, scene.hand)
    axes = places.speeds_mm_s, places.forces_n
    grid = np.meshgrid(*axes, indexing="ij")
    at = felt.parameters(grid[0].ravel(), grid[1].ravel())
    table = np.concatenate([at.noise_gain[:, None], *at[1:]], axis=1)
    table = table.reshape(*places.counts.shape, -1)
    truth = yardstick.features(at).at(places.counts.ravel())
    chosen = [
        [axis[list(some)] for some in subsets(axis.size)
         if axis[some[0]] <= low and axis[some[-1]] >= high]
        for axis, (low, high) in zip(axes, ends, strict=True)
    ]  # fmt: skip
    for speeds, forces in product(*chosen):
        index = np.ix_(np.isin(axes[0], speeds), np.isin(axes[1], forces))
        found = blended(table[index], (speeds, forces), axes)[places.counts]
        ours = Parameters(found[:, 0], *np.split(found[:, 1:], 3, axis=1))
        errors = errors_between(yardstick.features(ours), truth)
        cut = within_range(speeds, ends[0]), within_range(forces, ends[1])
        values = blended(table[index], (speeds, forces), cut)
        yield Driven(on_grid(felt, cut, values), errors)


def every_regression(felt: TextureModel, scene: Scene, yardstick: ComparedBand) -> Iterator[Driven]:
    places = places_of(felt, scene.hand)
    rows, columns = np.nonzero(places.counts)
    hand = places.speeds_mm_s[rows], places.forces_n[columns]
    truth = yardstick.features(felt.parameters(*hand))
    for by in ("conditions", "centroid"):
        try:
            model = regressed(felt, by=by)
        except InputError:
            continue
        yield Driven(model, errors_between(yardstick.features(model.parameters(*hand)), truth))


def cheapest_of_all(full: TextureModel, scene: Scene) -> tuple[Key, int]:
    """The least key of all candidates that keep the bound, and how many candidates there are."""
    yardstick = ComparedBand(
        full.rate_hz, narrowest_hz=float(full.bandwidths_hz.min()), band_hz=scene.actuator.band_hz
    )
    intervals = {max(1, round(ms * full.rate_hz / 1000)) for ms in INTERVALS_MS} | {1}
    best, looked_at = (np.inf, 0, 0), 0
    for kept in may_stay_alone(full, scene, places_of(full, scene.hand)):
        felt = felt_of(full, kept)
        places = places_of(felt, scene.hand)
        counts = places.counts.ravel()
        maps = ErrorMaps(felt, yardstick)
        rounded = maps.rounding(full.rate_hz)
        assert rounded is not None
        ways = [
            *every_grid(felt, scene, yardstick),
            *every_regression(felt, scene, yardstick),
        ]
        for samples, single in product(intervals, (True, False)):
            late = maps.late((samples - 1) / full.rate_hz, places).at(counts)
            taken = late + rounded if single else late
            plan = plan_for(full.rate_hz, update_samples=samples, single=single)
            for model, at_rest in ways:
                looked_at += 1
                together = [float(x.max()) for x in taken + at_rest]
                allowed = (np.arccos(scene.bound.gfc30), scene.bound.bands_db, scene.bound.level_db)
                if all(x <= most + 1e-9 for x, most in zip(together, allowed, strict=True)):
                    cost = plan.cost(model)
                    size = cost.table_bytes + cost.state_bytes
                    best = min(best, (cost.operations, size, numbers_of(model)))
    return best, looked_at


def numbers_of(model: TextureModel | RegressedModel) -> int:
    if isinstance(model, RegressedModel):
        return model.n_parameters
    return model.speeds_mm_s.size * model.forces_n.size * (1 + 3 * model.n_layers)


def key_of(compiled: CompiledTexture) -> Key:
    cost = compiled.after
    size = cost.table_bytes + cost.state_bytes
    return cost.operations, size, numbers_of(compiled.model)


GRIDS = {
    "linear": {"speeds_mm_s": (150.0, 210.0, 300.0), "forces_n": (1.0, 1.4, 1.9, 2.5)},
    "logarithmic": {"speeds_mm_s": (100.0, 200.0), "forces_n": (0.9, 1.2, 1.6)},
}
ALL = ((0.0, 1.0), (0.0, 1.0))
TIGHT = {"gfc30": 0.9999, "bands_db": 0.2, "level_db": 0.05}
MIDDLE = {"gfc30": 0.998, "bands_db": 0.5, "level_db": 0.3}
LOOSE = {"gfc30": 0.8, "bands_db": 4.0, "level_db": 3.0}


@pytest.mark.parametrize(
    ("blending", "shares", "bound", "seed"),
    [
        ("linear", ALL, {"gfc30": 1, "bands_db": 0, "level_db": 0}, 0),
        ("linear", ALL, TIGHT, 1),
        ("linear", ALL, {}, 3),
        ("linear", ((0.1, 0.9), (0.05, 0.3)), MIDDLE, 0),
        ("linear", ((0.2, 0.2), (0.3, 0.3)), TIGHT, 2),
        ("linear", ((1.0, 1.0), (0.0, 0.0)), {}, 4),
        ("logarithmic", ALL, TIGHT, 1),
        ("logarithmic", ALL, MIDDLE, 2),
        ("logarithmic", ALL, LOOSE, 4),
        ("logarithmic", ((0.375, 1.0), (0.0, 0.4)), TIGHT, 3),
        ("logarithmic", ((0.2, 0.2), (0.1, 0.8)), MIDDLE, 1),
    ],
)
def test_nothing_cheaper_keeps_the_bound(
    blending: str,
    shares: Any,
    bound: dict[str, float],
    seed: int,
    varied_model: ModelMaker,
    make_scene: SceneMaker,
    compile_one: Compile,
) -> None:
    """In scenes from one share of the grid to another, between nodes and at nodes."""
    full = varied_model(seed, blending=blending, **GRIDS[blending])
    hand = [
        tuple(axis[0] + share * (axis[-1] - axis[0]) for share in ends)
        for axis, ends in zip((full.speeds_mm_s, full.forces_n), shares, strict=True)
    ]
    scene = make_scene(*hand, **bound)
    least, looked_at = cheapest_of_all(full, scene)
    assert looked_at >= 100
    assert key_of(compile_one(full, scene)) == least


def test_a_layer_that_goes_may_be_the_one_that_needs_nodes(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    """The rest would have a coarser table; it is compared where the full one has nodes."""
    full = varied_model(0, blending="logarithmic")
    compiled = compile_one(full, make_scene())
    fewer = full.with_layers([n for n in range(3) if n + 1 not in compiled.dropped])
    assert fewer.table.values.shape[:2] != full.table.values.shape[:2]
    assert compiled.felt.table.values.shape[:2] == full.table.values.shape[:2]


def test_what_is_lost_against_the_full_model_is_judged_within_the_scene(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    """Without a layer to drop it is what the bound is about, or less: whatever lies beyond."""
    full = varied_model(3, weak=0)
    compiled = compile_one(full, make_scene((100.0, 200.0), (0.7, 2.0)))
    assert compiled.dropped == ()
    for measure in compiled.measures:
        # Moved to the scene's ends, the places are other ones than those that are bounded.
        assert measure.of_full == pytest.approx(measure.worst, rel=0.05, abs=5e-3)


# --- Order


SHARE = st.floats(0, 1)
SPEED_GRIDS = st.sampled_from([(60.0, 150.0, 300.0), (100.0, 300.0)])


def test_a_range_that_is_next_to_nothing_costs_no_more_than_a_wide_one(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    """Its ends are one number in single precision."""
    full = varied_model(0, blending="linear", speeds_mm_s=(60.0, 150.0, 300.0), forces_n=(1.0, 1.5))
    full = replace(full, level_sd_db=np.zeros(full.gains.shape))
    bound = {"gfc30": 0.99, "bands_db": 1.0, "level_db": 1.0}
    wide = key_of(compile_one(full, make_scene((60.0, 300.0), (1.0, 1.5), **bound)))
    for low in (1.0, 1.25):
        narrow = make_scene((60.0, 300.0), (low, low + 3e-8), **bound)
        assert key_of(compile_one(full, narrow))[:2] <= wide[:2]


@pytest.mark.long("compiles dozens of scenes")
@settings(max_examples=60)
@given(data=st.data())
def test_a_narrower_scene_or_a_looser_bound_never_gets_a_dearer_model(
    data: st.DataObject,
    varied_model: ModelMaker,
    make_scene: SceneMaker,
    compile_one: Compile,
) -> None:
    blending = data.draw(st.sampled_from(["linear", "logarithmic"]))
    seed = data.draw(st.integers(0, 9))
    grid = {"speeds_mm_s": data.draw(SPEED_GRIDS), "forces_n": (1.0, 1.5)}
    full = varied_model(seed, blending=blending, **grid)
    level_sd_db = np.full(full.gains.shape, data.draw(st.sampled_from([0.0, 4.0, 11.0])))
    full = replace(full, level_sd_db=level_sd_db)
    ends = [sorted(data.draw(st.tuples(*[SHARE] * 4))) for _ in range(2)]
    axes = [
        axis[0] + np.array(shares) * (axis[-1] - axis[0])
        for axis, shares in zip((full.speeds_mm_s, full.forces_n), ends, strict=True)
    ]
    bound = {
        "gfc30": data.draw(st.floats(0.9, 1)),
        "bands_db": data.draw(st.floats(0, 2)),
        "level_db": data.draw(st.floats(0, 2)),
    }
    looser = {
        "gfc30": bound["gfc30"] - data.draw(st.floats(0, 0.2)),
        "bands_db": bound["bands_db"] + data.draw(st.floats(0, 1)),
        "level_db": bound["level_db"] + data.draw(st.floats(0, 1)),
    }
    wide, narrow = ([(x[i], x[3 - i]) for x in axes] for i in (0, 1))
    reference = key_of(compile_one(full, make_scene(*wide, **bound)))
    assert key_of(compile_one(full, make_scene(*narrow, **bound)))[:2] <= reference[:2]
    assert key_of(compile_one(full, make_scene(*wide, **looser)))[:2] <= reference[:2]


def test_a_layer_that_goes_in_a_scene_goes_in_a_narrower_one(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    """Neither scene holds all recorded conditions, the narrower one none."""
    full = varied_model(1, blending="logarithmic", speeds_mm_s=(100.0, 300.0), forces_n=(1.0, 1.5))
    full = replace(full, level_sd_db=np.full(full.gains.shape, 11.0))
    wide = compile_one(full, make_scene((100.0, 220.0), 1.0))
    narrow = compile_one(full, make_scene((140.0, 220.0), 1.0))
    assert set(wide.dropped) <= set(narrow.dropped)
    assert narrow.after.operations <= wide.after.operations


@settings(max_examples=12)
@given(
    seed=st.integers(0, 9),
    speeds=st.tuples(st.floats(60, 300), st.floats(60, 300)).map(sorted),
    forces=st.tuples(st.floats(0.5, 3), st.floats(0.5, 3)).map(sorted),
)
def test_the_least_model_ends_where_the_scene_ends(
    seed: int,
    speeds: list[float],
    forces: list[float],
    varied_model: ModelMaker,
    make_scene: SceneMaker,
    compile_one: Compile,
) -> None:
    compiled = compile_one(varied_model(seed), make_scene(speeds, forces))
    model = compiled.model
    axes = (model.speeds_mm_s, speeds), (model.forces_n, forces)
    for axis, ends in axes:
        assert axis[0] == ends[0]
        if compiled.way == "grid" or ends[0] < ends[1]:
            assert axis[-1] == ends[1]
    note = model.compiled_for
    assert note is not None
    assert note.update_s * 5000 == pytest.approx(compiled.plan.update_samples)
    assert (note.full_sha256, note.single) == (compiled.full.sha256, compiled.plan.single)


# --- What cannot be compiled


def test_a_texture_without_a_model_is_named(
    varied_model: ModelMaker, make_scene: SceneMaker
) -> None:
    model = varied_model(0)
    scene = make_scene(textures=(model.texture, "felt"))
    with refused(InputError, expected="planted", got="felt"):
        compile_scene(scene, {model.texture: model})
    with refused(InputError, expected="planted", got="none"):
        compile_scene(make_scene(), {})
    with refused(InputError, expected="planted", got="driven"):
        compile_scene(make_scene(), {"driven": regressed(model)})  # type: ignore[dict-item]


@pytest.mark.parametrize(
    ("hand", "expected", "got"),
    [
        (((50, 300), (0.5, 3)), ["varied 0", "60…300 mm/s"], "50…300 mm/s"),
        (((60, 301), (0.5, 3)), ["varied 0", "60…300 mm/s"], "60…301 mm/s"),
        (((60, 300), (0.4, 3)), ["varied 0", "0.5…3 N"], "0.4…3 N"),
        (((60, 300), (4, 5)), ["varied 0", "0.5…3 N"], "4…5 N"),
    ],
)
def test_a_scene_beyond_the_grid_is_refused(
    hand: Any,
    expected: object,
    got: object,
    varied_model: ModelMaker,
    make_scene: SceneMaker,
    compile_one: Compile,
) -> None:
    with refused(InputError, expected=expected, got=got):
        compile_one(varied_model(0), make_scene(*hand))


def test_a_rate_below_the_models_is_refused(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    scene = make_scene(actuator=Actuator(rate_hz=4000))
    with refused(InputError, expected="5000 Hz", got=4000):
        compile_one(varied_model(0), scene)


def test_a_band_beyond_the_model_is_refused(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    scene = make_scene(actuator=Actuator(band_hz=(2500, 4000)))
    with refused(
        InputError, expected=["10…2450 Hz", "5000 Hz"], got=["2500 to 2450 Hz", "band_hz"]
    ):
        compile_one(varied_model(0), scene)


def test_a_model_in_arbitrary_units_is_refused(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    with refused(InputError, names="varied 0", expected="g", got="'arbitrary'"):
        compile_one(varied_model(0, unit="arbitrary"), make_scene())


# --- The actuator's limits


@pytest.mark.parametrize("peak", [0.1, 0.5, 1.0, 2.0, 4.0])
def test_clipping_takes_as_much_as_it_takes_of_noise(peak: float) -> None:
    noise = np.random.default_rng(0).standard_normal(400_000)
    lost_db = -10 * np.log10(np.mean(np.clip(noise, -peak, peak) ** 2) / np.mean(noise**2))
    assert clipped_loss_db(np.array([1.0, 0.0]), peak) == pytest.approx([lost_db, 0], abs=0.02)


def test_without_a_peak_nothing_is_clipped() -> None:
    assert clipped_loss_db(np.array([0.0, 1.0, 1e9]), np.inf).tolist() == [0, 0, 0]
    assert clipped_loss_db(np.array([1.0]), 1e-3) == pytest.approx(60, abs=0.1)


@pytest.mark.parametrize("limits", [{"peak_g": 0.15}, {"rms_g": 0.08}])
def test_a_level_that_the_limits_break_is_refused_with_the_nearest(
    limits: dict[str, float], varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    full, actuator = varied_model(1), Actuator(**limits)
    with refused(
        InputError,
        expected=["level_db", "[bound]"],
        got=["0.2 dB", "varied 1", "300 mm/s, 3 N", "level_db"],
    ) as no:
        compile_one(full, make_scene(actuator=actuator, level_db=0.2))
    nearest = float(re.findall(r"level_db = ([0-9.]+)[.]$", str(no.value))[0])
    compiled = compile_one(full, make_scene(actuator=actuator, level_db=nearest))
    with refused(InputError, expected=["level_db", "[bound]"], got=["varied 1", "level_db"]):
        compile_one(full, make_scene(actuator=actuator, level_db=nearest - 0.02))
    samples = compiled.renderer().render(300.0, 3.0, samples=20_000)
    assert np.abs(samples).max() <= np.float32(limits.get("peak_g", np.inf))


def test_what_limits_take_counts_towards_the_level(
    varied_model: ModelMaker, make_scene: SceneMaker, compile_one: Compile
) -> None:
    full, actuator = varied_model(1), Actuator(rms_g=0.08)
    loss_db = float(20 * np.log10(full_rms(full) / 0.08))
    tight = compile_one(full, make_scene(actuator=actuator, level_db=loss_db + 1e-3))
    wide = compile_one(full, make_scene(actuator=actuator, level_db=loss_db + 0.2))
    for compiled, bound in ((tight, loss_db + 1e-3), (wide, loss_db + 0.2)):
        [level] = [m for m in compiled.measures if m.measure == "level_db"]
        assert loss_db <= level.worst <= bound
    assert key_of(wide) <= key_of(tight)


def full_rms(full: TextureModel) -> float:
    """RMS at the fastest and strongest condition, over the frequencies that are judged."""
    yardstick = ComparedBand(
        full.rate_hz, narrowest_hz=float(full.bandwidths_hz.min()), band_hz=None
    )
    at = full.parameters([300.0], [3.0])
    return float(np.sqrt(yardstick.power(at)[0]))


# --- Budgets


def two_models(varied_model: ModelMaker) -> dict[str, TextureModel]:
    return {str(seed): varied_model(seed, texture=str(seed)) for seed in (1, 2)}


def test_a_budget_below_the_smallest_model_is_refused_with_the_nearest_bound(
    varied_model: ModelMaker, make_scene: SceneMaker
) -> None:
    models = two_models(varied_model)
    bound = {"gfc30": 0.99, "bands_db": 0.5, "level_db": 0.4}
    scene = make_scene(**bound)
    free = compile_scene(scene, models)
    for budget in (
        Budget(operations=free.operations_after - 1),
        Budget(bytes=free.bytes_after - 200),
    ):
        small = replace(scene, budget=budget)
        with refused(
            InputError,
            expected="planted",
            got=["operations per sample", "bytes", "gfc30", "bands_db", "level_db"],
        ) as no:
            compile_scene(small, models)
        told = dict(re.findall(r"(gfc30|bands_db|level_db) = ([0-9.]+[0-9])", str(no.value)))
        nearest = Bound(**{name: float(value) for name, value in told.items()})
        fitting = compile_scene(replace(small, bound=nearest), models)
        assert fitting.operations_after <= budget.most_operations(5000)
        assert fitting.bytes_after <= budget.most_bytes
        assert nearest.gfc30 < 0.99


def test_a_budget_of_next_to_nothing_has_no_nearest_bound(
    varied_model: ModelMaker, make_scene: SceneMaker
) -> None:
    scene = make_scene(budget=Budget(operations=1))
    with refused(
        InputError,
        expected=["planted", "1 operations per sample"],
        got=["operations per sample", "bytes"],
    ):
        compile_scene(scene, two_models(varied_model))


def test_fewer_bytes_are_bought_by_shorter_update_intervals(
    varied_model: ModelMaker, make_scene: SceneMaker
) -> None:
    models = two_models(varied_model)
    scene = make_scene(gfc30=0.99, bands_db=0.9, level_db=0.9)
    free = compile_scene(scene, models)
    budget = Budget(bytes=free.bytes_after - 1)
    tight = compile_scene(replace(scene, budget=budget), models)
    assert tight.bytes_after < free.bytes_after
    samples = [[t.plan.update_samples for t in each.textures] for each in (tight, free)]
    assert all(ours <= theirs for ours, theirs in zip(*samples, strict=True))
    assert samples[0] != samples[1]
    for measured in (m for texture in tight.textures for m in texture.measures):
        kept = measured.worst - measured.bound
        assert (-kept if measured.measure == "gfc30" else kept) <= 1e-9
