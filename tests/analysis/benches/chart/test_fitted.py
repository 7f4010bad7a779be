"""Costs by counting, and filters in motion against what is really rendered."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import analysis.benches
import modeling.rendering
from analysis.benches.accuracy import stroke
from analysis.benches.chart.fitted import (
    COST_RATE_HZ,
    Layered,
    Predictor,
    Shaped,
    block_samples,
    predictor_cost,
    shaped_noise_cost,
)
from analysis.benches.chart.shaped_noise import ShapedNoise
from analysis.benches.rivals import CompiledStream, predictor_of, tabled_predictor
from modeling import regressed, render_many
from modeling.rendering.plan import RenderPlan
from stimuli.planted.textures import planted_texture

HERE = Path(__file__).parent
FOLDERS = (
    Path(modeling.rendering.__file__).parent,
    Path(analysis.benches.__file__).parent,
    HERE.parents[2] / "modeling" / "rendering",
)
WHAT = ("additions", "multiplications", "divisions", "square_roots")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("g++") is None:
        pytest.skip("g++ is not installed (see tools/system-packages)")
    program = tmp_path_factory.mktemp("programs") / "counted_predictor"
    included = [f"-I{folder}" for folder in FOLDERS]
    source = HERE.parent / "counted_predictor.cpp"
    subprocess.run(["g++", "-std=c++17", *included, source, "-o", program], check=True)
    return program


@pytest.mark.parametrize("order", [4, 6, 12, 20, 30, 40])
def test_an_autoregressive_filter_costs_what_its_program_counts(program: Path, order: int) -> None:
    run = subprocess.run([program, str(order)], check=True, capture_output=True, text=True)
    counted = {name: int(value) for name, value in map(str.split, run.stdout.splitlines())}
    cost = predictor_cost(order, conditions=49, update_samples=1, single=False)
    for part, told in (("sample", cost.per_sample), ("update", cost.per_update)):
        assert [getattr(told, w) for w in WHAT] == [counted[f"{part}_{w}"] for w in WHAT]


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


def test_filters_of_a_predictor_in_motion_are_what_is_rendered() -> None:
    model = predictor_of(planted_texture("canvas"))
    hand = stroke(model.rate_hz, duration_s=0.5)
    table = tabled_predictor(model)
    speed, force = np.abs(hand.speed_mm_s), hand.force_n
    rendered = np.stack(
        [
            CompiledStream("AR(20)", table, update_samples=1, seed=seed).render(speed, force)
            for seed in range(1500)
        ]
    )
    filters = Predictor(model).moving(hand, 1, places=PLACES, rate_hz=model.rate_hz)
    found = np.sqrt(np.mean(rendered[:, PLACES] ** 2, axis=0))
    assert found / levels(filters, model.rate_hz) == pytest.approx(1, abs=0.075)


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
