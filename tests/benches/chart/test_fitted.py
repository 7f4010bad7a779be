"""Costs by counting, and filters in motion against what is really rendered."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tactileq.benches.rendering
import tactileq.modeling.rendering
from tactileq.benches.chart.fitted import Layered, extrapolated_to_ends
from tactileq.benches.chart.rival_costs import (
    COST_RATE_HZ,
    bands_cost,
    block_samples,
    coefficients_cost,
    grains_cost,
    loops_cost,
    shaped_noise_cost,
)
from tactileq.benches.chart.rival_fits import Filtered, Grained, Looped, Shaped
from tactileq.benches.chart.shaped_noise import ShapedNoise
from tactileq.benches.rendering.accuracy import stroke
from tactileq.benches.rendering.coefficients import BandTable, tabled_bands
from tactileq.benches.rendering.rivals import (
    BANDS,
    COEFFICIENTS,
    CompiledStream,
    SoundStream,
    predictor_of,
)
from tactileq.benches.rendering.stored_sounds import Grains, Loops
from tactileq.modeling import regressed, render_many
from tactileq.modeling.hand import Hand
from tactileq.modeling.rendering.cost import Cost
from tactileq.modeling.rendering.plan import RenderPlan
from tactileq.stimuli.planted.textures import planted_texture

HERE = Path(__file__).parent
FOLDERS = (
    Path(tactileq.modeling.rendering.__file__).parent,
    Path(tactileq.benches.rendering.__file__).parent,
    HERE.parents[1] / "modeling" / "rendering",
)
WHAT = ("additions", "multiplications", "divisions", "square_roots")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("g++") is None:
        pytest.skip("g++ is not installed (see tools/system-packages)")
    program = tmp_path_factory.mktemp("programs") / "counted_rivals"
    included = [f"-I{folder}" for folder in FOLDERS]
    source = HERE.parent / "rendering" / "counted_rivals.cpp"
    subprocess.run(["g++", "-std=c++17", *included, source, "-o", program], check=True)
    return program


def check_counts(program: Path, name: str, cost: Cost, *orders: int, bands: int = 1) -> None:
    arguments = [program, *map(str, orders or (4, 0)), str(bands)]
    run = subprocess.run(arguments, check=True, capture_output=True, text=True)
    counted = {name: int(value) for name, value in map(str.split, run.stdout.splitlines())}
    for part, told in (("sample", cost.per_sample), ("update", cost.per_update)):
        assert [getattr(told, w) for w in WHAT] == [counted[f"{name}_{part}_{w}"] for w in WHAT]


@pytest.mark.parametrize("orders", [(4, 0), (6, 0), (12, 0), (20, 0), (40, 0), (4, 4), (8, 8)])
def test_a_filter_by_coefficients_costs_what_its_program_counts(
    program: Path, orders: tuple[int, int]
) -> None:
    cost = coefficients_cost(*orders, nodes=49, update_samples=1, single=False)
    check_counts(program, "coefficients", cost, *orders)


@pytest.mark.parametrize("layers", [1, 2, 4, 7])
def test_bands_cost_what_their_program_counts(program: Path, layers: int) -> None:
    cost = bands_cost(layers, nodes=49, update_samples=1, single=False)
    check_counts(program, "bands", cost, bands=layers)


def test_loops_cost_what_their_program_counts(program: Path) -> None:
    cost = loops_cost(nodes=6, numbers=300, update_samples=1, single=False)
    check_counts(program, "loops", cost)


def test_grains_cost_what_their_program_counts(program: Path) -> None:
    cost = grains_cost(8, nodes=6, numbers=300, single=False)
    # The program is given the hand where it should be in the middle of a grain.
    extrapolating = loops_cost(nodes=6, numbers=0, update_samples=2, single=False).per_update
    without = loops_cost(nodes=6, numbers=0, update_samples=1, single=False).per_update
    parts = (getattr(extrapolating, w) - getattr(without, w) for w in WHAT)
    update = type(cost.per_update)(
        *(getattr(cost.per_update, w) - part for w, part in zip(WHAT, parts, strict=True))
    )
    check_counts(program, "grains", replace(cost, per_update=update))


# Sorensen, Jones, Heideman and Burrus 1987, table of the real-valued split-radix FFT: n, products,
# sums.
@pytest.mark.parametrize(
    ("block", "products", "sums"), [(16, 10, 60), (64, 98, 420), (256, 642, 2436)]
)
def test_fft_costs_what_was_published(block: int, products: int, sums: int) -> None:
    cost = shaped_noise_cost(block, numbers=0, single=False)
    half = block // 2
    rest = (12 + 6 * half + block + half + 14, 5 + 6 * half + 2 * block + 2 * block + 6)
    assert cost.per_update.additions - rest[0] == sums
    assert cost.per_update.multiplications - rest[1] == products
    assert cost.update_samples == half
    assert cost.most_operations == cost.per_update.total


def test_layers_cost_what_their_plan_tells() -> None:
    fitted = Layered(planted_texture("canvas"))
    model = fitted.model
    plan = RenderPlan(rate_hz=COST_RATE_HZ, update_samples=20, single=True)
    assert fitted.cost(4.0, single=True) == plan.cost(model)
    assert fitted.numbers == 49 * (1 + 3 * model.n_layers)
    driven = Layered(regressed(model))
    assert driven.numbers < 4 * (1 + 3 * model.n_layers) + 1
    assert driven.cost(4.0, single=True).table_bytes < plan.cost(model).table_bytes
    assert set(fitted.blendings()) == {"linear", "logarithmic"}
    assert set(driven.blendings()) == {"regression"}


def test_half_the_bytes_in_single_precision() -> None:
    fitted = Layered(planted_texture("canvas"))
    double, single = (fitted.cost(1.0, single=precision) for precision in (False, True))
    assert single.table_bytes * 2 == double.table_bytes
    assert single.operations == double.operations
    assert fitted.single_error_db(stroke(5000.0, duration_s=0.2), 5) < -100


def levels(filters: list, rate_hz: float) -> np.ndarray:
    """RMS of what each filter makes of white noise."""
    frequency = np.linspace(0, rate_hz / 2, 2001)
    return np.array([np.sqrt(np.mean(f.response(frequency) ** 2)) for f in filters])


PLACES = list(range(1500, 2500, 100))


def test_filters_of_layers_in_motion_are_what_is_rendered() -> None:
    model = planted_texture("canvas")
    hand = stroke(model.rate_hz, duration_s=0.5)
    streams = 1500
    rendered = np.stack(
        render_many(
            [model] * streams, [hand] * streams, seeds=[0] * streams, streams=range(streams)
        )
    )
    filters = Layered(model).moving(hand, 5, places=PLACES, rate_hz=model.rate_hz)
    found = np.sqrt(np.mean(rendered[:, PLACES] ** 2, axis=0))
    # The RMS of 1,500 draws scatters by 1/√3000 = 1.8 %.
    assert found / levels(filters, model.rate_hz) == pytest.approx(1, abs=0.075)


def found_levels(rendered: list[np.ndarray], places: list[int]) -> np.ndarray:
    return np.sqrt(np.mean(np.stack(rendered)[:, places] ** 2, axis=0))


def rendered_by(fitted: Filtered, hand: Hand, *, streams: int) -> list[np.ndarray]:
    kind = BANDS if isinstance(fitted.model, BandTable) else COEFFICIENTS
    speed, force = np.abs(hand.speed_mm_s), hand.force_n
    return [
        CompiledStream(kind, fitted.model, update_samples=1, seed=seed).render(speed, force)
        for seed in range(streams)
    ]


@pytest.mark.parametrize("kind", ["predictor", "bands"])
def test_filters_by_coefficients_in_motion_are_what_is_rendered(kind: str) -> None:
    """Bands in direct form are 3 dB too loud where the hand turns, and more; this is told, too."""
    texture = planted_texture("canvas")
    table = tabled_bands(texture)
    fitted = Filtered.of(predictor_of(texture)) if kind == "predictor" else Filtered(table, 49)
    hand = stroke(texture.rate_hz, duration_s=0.5)
    filters = fitted.moving(hand, 1, places=PLACES, rate_hz=texture.rate_hz)
    found = found_levels(rendered_by(fitted, hand, streams=1500), PLACES)
    assert found / levels(filters, texture.rate_hz) == pytest.approx(1, abs=0.075)
    frozen = [fitted.filter(abs(hand.speed_mm_s[n]), hand.force_n[n]) for n in PLACES]
    off_db = 20 * np.log10(found / levels(frozen, texture.rate_hz))
    assert bool(np.abs(off_db).max() > 1.0) is (kind == "bands")


GRID = np.array([50.0, 150.0, 350.0]), np.array([0.5, 1.5, 3.5])


@pytest.mark.parametrize("update_samples", [1, 5, 20, 80])
def test_loops_in_motion_are_what_is_played(update_samples: int) -> None:
    """Of loops that hold one number, so that levels are exact; the hand is read at updates.

    Between the nodes of a cell weights ramp, where the place is blended: up to 1 % apart.
    """
    rate_hz, speeds, forces = 5000.0, np.linspace(25.0, 350.0, 14), np.linspace(0.5, 3.5, 13)
    loops = Loops(
        speeds_mm_s=speeds,
        forces_n=forces,
        samples=np.ones((14, 13, 50), dtype=np.int16),
        scales=speeds[:, None] ** 0.8 * forces**0.5,
        rate_hz=rate_hz,
    )
    hand = stroke(rate_hz, duration_s=0.5)
    ends = extrapolated_to_ends(hand, update_samples, rate_hz=rate_hz)
    read = Hand(*(np.repeat(reading, update_samples)[: hand.speed_mm_s.size] for reading in ends))
    played = SoundStream(loops, update_samples=update_samples, seed=0).render(*read)
    filters = Looped(loops).moving(hand, update_samples, places=PLACES, rate_hz=rate_hz)
    # A number is a line at 0 Hz, of √N times its amplitude.
    found = np.array([one.response(np.zeros(1))[0] for one in filters]) / np.sqrt(50)
    assert found == pytest.approx(played[PLACES], rel=0.02)


def test_grains_in_motion_are_what_is_played() -> None:
    rate_hz, block = 1000.0, 64
    rng = np.random.default_rng(1)
    shares = np.array([1.0, 3.0, 4.0])[:, None] * np.array([1.0, 2.0, 2.5])
    sounds = rng.integers(-9000, 9000, (3, 3, 1500)).astype(np.int16)
    grains = Grains(
        speeds_mm_s=GRID[0],
        forces_n=GRID[1],
        samples=sounds,
        scales=1e-4 * shares,
        rate_hz=rate_hz,
        block=block,
    )
    hand = stroke(rate_hz, duration_s=0.75)
    places = list(range(300, 700, 37))
    half = block // 2
    # Read when a grain begins: where the hand should be in its middle, linearly extrapolated.
    before = Hand(*(np.concatenate((x[:half], x[:-half])) for x in hand))
    amid = Hand(*(2 * now - last for now, last in zip(hand, before, strict=True)))
    rendered = [
        SoundStream(grains, update_samples=1, seed=seed).render(*amid) for seed in range(1500)
    ]
    filters = Grained(grains, 0.064).moving(hand, half, places=places, rate_hz=rate_hz)
    found = found_levels(rendered, places)
    assert found / levels(filters, rate_hz) == pytest.approx(1, abs=0.075)


@pytest.mark.long("averages: 1,500 strokes of a rival")
def test_filters_of_fft_shaped_noise_in_motion_are_what_is_rendered() -> None:
    rate_hz = 1000.0
    grid = np.array([[0.5, 1.0], [2.0, 4.0]])[..., None] * np.linspace(1.0, 0.2, 33)
    noise = ShapedNoise(np.array([50.0, 350.0]), np.array([0.5, 3.5]), grid, rate_hz)
    hand = stroke(rate_hz, duration_s=0.75)
    places = list(range(300, 700, 37))
    half = noise.block // 2
    reads = range(0, len(hand.speed_mm_s) - half, half)
    # What a block is made for: the hand extrapolated from its last two readings.
    read = [[2 * r[n] - r[max(n - half, 0)] for r in hand] for n in reads]
    rng = np.random.default_rng(0)
    rendered = np.stack([noise.render(read, rng) for _ in range(1500)])
    filters = Shaped(noise, 0.064).moving(hand, half, places=places, rate_hz=rate_hz)
    found = np.sqrt(np.mean(rendered[:, places] ** 2, axis=0))
    assert found / levels(filters, rate_hz) == pytest.approx(1, abs=0.075)


@pytest.mark.parametrize(
    ("block_s", "rate_hz", "block"), [(1 / 16, 1000.0, 64), (1 / 4, 5000.0, 1024)]
)
def test_blocks_are_powers_of_two(block_s: float, rate_hz: float, block: int) -> None:
    assert block_samples(block_s, rate_hz) == block
