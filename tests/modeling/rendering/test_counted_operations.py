"""Operations of the kernel, counted by a program whose numbers count what is done with them."""

from __future__ import annotations

import itertools
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactileq.modeling.rendering
from tactileq.benches.rendering.rivals import layered_texture
from tactileq.modeling import Limits, compensation_for
from tactileq.modeling.rendering.plan import RenderPlan, plan_for
from tactileq.stimuli.planted.vibrators import planted_vibrator

HERE = Path(__file__).parent
KERNEL_FOLDER = Path(tactileq.modeling.rendering.__file__).parent
pytestmark = pytest.mark.skipif(
    shutil.which("g++") is None, reason="g++ is not installed (see tools/system-packages)"
)
WHAT = ("additions", "multiplications", "divisions", "square_roots", "table_reads")
PARTS = ("sample", "output", "update", "chunk")

Count = Callable[..., dict[str, int]]


@pytest.fixture(scope="module")
def count(tmp_path_factory: pytest.TempPathFactory) -> Count:
    """Counts for a texture of these layers and so on, by name."""
    program = tmp_path_factory.mktemp("programs") / "counted_operations"
    options = ["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{KERNEL_FOLDER}"]
    source = HERE / "counted_operations.cpp"
    subprocess.run(["g++", *options, source, "-o", program], check=True)

    def counted(**texture: int) -> dict[str, int]:
        arguments = [f"{name}={value}" for name, value in texture.items()]
        run = subprocess.run([program, *arguments], check=True, capture_output=True, text=True)
        return {name: int(value) for name, value in map(str.split, run.stdout.splitlines())}

    return counted


@pytest.mark.parametrize("restrained", [0, 1])
@pytest.mark.parametrize("update_samples", [1, 5, 32])
@pytest.mark.parametrize("interpolated", [0, 1])
def test_counts_are_linear_in_layers(
    count: Count, interpolated: int, update_samples: int, restrained: int
) -> None:
    texture = {"interpolated": interpolated, "update_samples": update_samples}
    texture |= dict.fromkeys(("notch", "peak", "rms", "duration"), restrained)
    layers = np.arange(9)
    counts = [count(layers=some, **texture) for some in layers]
    for part, what in itertools.product(PARTS, WHAT):
        by_layers = np.array([of[f"{part}_{what}"] for of in counts])
        if (part, what) == ("update", "multiplications"):
            # The largest legal frequency and bandwidth, once for every four layers side by side.
            by_layers -= 2 * np.ceil(layers / 4).astype(int)
        assert (np.diff(by_layers) == by_layers[1] - by_layers[0]).all(), (part, what)


@pytest.mark.parametrize("texture", [{"layers": 3}, {"interpolated": 1, "rms": 1, "notch": 1}])
@pytest.mark.parametrize("update_samples", [1, 5, 32])
def test_parts_add_up_to_a_block(
    count: Count, texture: dict[str, int], update_samples: int
) -> None:
    counts = count(update_samples=update_samples, **texture)
    for what in WHAT:
        parts = sum(counts[f"{part}_{what}"] * counts[f"block_{part}s"] for part in PARTS)
        assert parts == counts[f"block_{what}"]


def test_counts_are_those_of_the_equations(count: Count) -> None:
    """docs/method/rendering.md: a layer's recursion, and a table read at four corners."""
    none, one = count(layers=0), count(layers=1)
    added = {name: one[name] - none[name] for name in one}
    # Six products and six sums turn the state and take in the noise; the band-pass is the sum of
    # two states times a gain, which moves by one sum; one more adds it to the other layers.
    assert [added[f"sample_{what}"] for what in WHAT] == [9, 7, 0, 0, 0]
    assert added["update_square_roots"] == 1
    assert added["update_table_reads"] == 4 * 3  # frequency, bandwidth, gain
    assert none["update_table_reads"] == 4  # the noise gain


def test_interpolation_compensation_and_limits_cost_what_they_say(count: Count) -> None:
    """FIR filters of so many taps, a band without layer, the running mean square with its root."""
    bare = count()
    for more, expected in {
        "interpolated": [9, 10, 0, 0, 0],
        "notch": [9, 7, 0, 0, 0],
        "rms": [3, 5, 1, 1, 0],
        "peak": [0] * 5,
        "duration": [0] * 5,
    }.items():
        counts = count(**{more: 1})
        added = [counts[f"output_{what}"] - bare[f"output_{what}"] for what in WHAT]
        assert added == expected, more
        twice = [counts[f"sample_{what}"] - bare[f"sample_{what}"] for what in WHAT]
        assert twice == ([2 * 31, 2 * 32, 0, 0, 0] if more == "interpolated" else [0] * 5)


@pytest.mark.parametrize("layers", range(9))
@pytest.mark.parametrize("update_samples", [1, 5, 32])
@pytest.mark.parametrize("rate_hz", [5000.0, 48_000.0])
@pytest.mark.parametrize("restrained", [False, True])
def test_a_plan_tells_what_was_counted(
    count: Count, layers: int, update_samples: int, rate_hz: float, restrained: bool
) -> None:
    model = layered_texture(layers) if layers else layered_texture(1).with_layers([])
    restraints: dict[str, Any] = {}
    if restrained:
        restraints["limits"] = Limits(peak=1.0, rms=0.5, duration_s=1.0)
        restraints["compensation"] = compensation_for(planted_vibrator(), rate_hz=rate_hz)
    samples = round(update_samples * rate_hz / 5000)
    plan = plan_for(5000.0, rate_hz=rate_hz, update_samples=samples, **restraints)
    cost = plan.cost(model)
    on = dict.fromkeys(("notch", "peak", "rms", "duration"), int(restrained))
    interpolated = int(rate_hz > 5000)
    counts = count(layers=layers, interpolated=interpolated, update_samples=update_samples, **on)
    for part in ("sample", "update", "output"):
        told = getattr(cost, f"per_{part}")
        assert vars(told) == {what: counts[f"{part}_{what}"] for what in vars(told)}
    assert cost.bytes_per_update == 8 * counts["update_table_reads"]
    together = cost.per_sample.total + cost.per_update.total + cost.per_output.total
    assert cost.most_operations == together
    sample = cost.per_sample.total + cost.per_update.total / update_samples
    assert cost.operations == pytest.approx(cost.per_output.total + sample * 5000 / rate_hz)


def test_a_plan_tells_the_bytes_of_a_texture_and_its_state() -> None:
    """Those of an export, and of the memory that the kernel asks for with one lane."""
    model = layered_texture(3)
    double, single = (RenderPlan(rate_hz=5000.0, update_samples=5, single=s) for s in (False, True))
    arrays = [value for value in double.texture(model).values() if np.ndim(value)]
    assert double.cost(model).table_bytes == sum(np.asarray(array).nbytes for array in arrays)
    assert double.cost(model).state_bytes == 8 * 10 * 3
    halved = ("table_bytes", "state_bytes", "bytes_per_sample", "bytes_per_update")
    for name in halved:
        assert getattr(single.cost(model), name) * 2 == getattr(double.cost(model), name)
    assert single.cost(model).per_sample == double.cost(model).per_sample
