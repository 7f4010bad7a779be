"""A scene's header: one hand, many textures; switches without a click, bits of the Renderer."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tactileq.modeling import (
    InputError,
    Limits,
    RegressedModel,
    Renderer,
    TextureModel,
    compensation_for,
    regressed,
)
from tactileq.modeling.rendering.plan import RenderPlan, plan_for
from tactileq.modeling.rendering.reference.compensator import Compensator
from tactileq.modeling.rendering.reference.limiter import Limiter
from tactileq.stimuli.exports.scene_header import scene_header, scene_identifier
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tests.refusals import refused

SEED = 7
EXACT = ["-O2", "-ffp-contract=off", "-fno-math-errno"]
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror"]
C = ["gcc", "-std=c99", *STRICT]
# Tables leave out members that are 0, and name the others, which C++17 does not know.
CPP = ["g++", "-x", "c++", "-std=c++17", *STRICT, "-Wno-pedantic"]
CPP += ["-Wno-missing-field-initializers"]

# Blocks of this size, cut where a texture is switched to. On standard input n speeds and n forces;
# to standard output n samples, the indices that play, the counters.
PROGRAM = """
#include HEADER
#include <stdio.h>
#include <stdlib.h>
enum { LONGEST = 60000, COUNTERS = 7 };
static double hand[2 * LONGEST], result[2 * LONGEST + COUNTERS];
static tq_real speed[LONGEST], force[LONGEST], out[LONGEST], memory[MEMORY];
static tq_scene_hand touching;
int main(int argc, char **argv)
{
    size_t block = (size_t)atoi(argv[1]), held = (size_t)atoi(argv[2]);
    uint32_t number = (uint32_t)atoi(argv[3]);
    size_t count = fread(hand, sizeof(double), 2 * LONGEST, stdin) / 2, done = 0, n, next;
    int word = 5;
    for (n = 0; n < count; n++)
        speed[n] = (tq_real)hand[n], force[n] = (tq_real)hand[count + n];
    tq_scene_start(&touching, &SCENE, memory, number, atoi(argv[4]));
    for (; done < count; done += next) {
        next = count - done < block ? count - done : block;
        for (; word + 1 < argc && (size_t)atoi(argv[word]) == done; word += 2)
            tq_scene_switch(&touching, atoi(argv[word + 1]));
        if (word + 1 < argc && (size_t)atoi(argv[word]) < done + next)
            next = (size_t)atoi(argv[word]) - done;
        if (held)
            tq_scene_render_held(&touching, speed[done], force[done], out + done, next);
        else
            tq_scene_render(&touching, speed + done, force + done, out + done, next);
        for (n = done; n < done + next; n++)
            result[count + n] = touching.now;
    }
    for (n = 0; n < count; n++)
        result[n] = (double)out[n];
    result[2 * count] = (double)touching.state.counters.lift_offs;
    result[2 * count + 1] = (double)touching.state.counters.above_grid;
    result[2 * count + 2] = (double)touching.state.counters.below_grid;
    result[2 * count + 3] = (double)touching.state.counters.clamped;
    result[2 * count + 4] = (double)touching.state.counters.peak;
    result[2 * count + 5] = (double)touching.state.counters.rms;
    result[2 * count + 6] = (double)touching.state.counters.duration;
    return fwrite(result, sizeof(double), 2 * count + COUNTERS, stdout) != 2 * count + COUNTERS;
}
"""

Models = Sequence[TextureModel | RegressedModel]
Switches = Sequence[tuple[int, int]]
Hand = tuple[np.ndarray, np.ndarray]


def clamped() -> RegressedModel:
    """Straight lines by which noise gain and widths fall below 0 at 200 mm/s."""
    model = regressed(planted_texture("canvas"))
    bandwidths = np.zeros_like(model.bandwidths_hz)
    bandwidths[:2] = [[50.0], [-0.25]]
    noise_gain = np.array([0.1, -0.0005, 0.0, 0.0])
    return replace(model, noise_gain=noise_gain, bandwidths_hz=bandwidths)


MODELS: Models = [
    planted_texture("canvas"),
    planted_texture("MDF"),
    planted_texture("PVC").with_layers([]),
    clamped(),
]
UPDATES_MS = (1.0, 0.2, 6.4, 2.0)
LIMITS = Limits(peak=0.3, rms=0.05, rms_window_s=0.05, duration_s=0.15, pause_s=0.02)


@dataclass(frozen=True)
class Case:
    """How the textures are rendered."""

    rate_hz: float
    single: bool = False
    restrained: bool = False

    def plans(self) -> list[RenderPlan]:
        options: dict[str, Any] = {"rate_hz": self.rate_hz, "single": self.single}
        if self.restrained:
            compensation = compensation_for(planted_vibrator(), rate_hz=self.rate_hz)
            options |= {"limits": LIMITS, "compensation": compensation}
        periods = [round(period * self.rate_hz / 1000) for period in UPDATES_MS]
        return [plan_for(5000.0, update_samples=period, **options) for period in periods]

    def rendered(self) -> list[tuple[Any, RenderPlan]]:
        return list(zip(MODELS, self.plans(), strict=True))


CASES = {
    "5 kHz": Case(5000.0),
    "48 kHz": Case(48_000.0),
    "5 kHz, restrained": Case(5000.0, restrained=True),
    "48 kHz, restrained": Case(48_000.0, restrained=True),
    "5 kHz, single": Case(5000.0, single=True),
    "48 kHz, single": Case(48_000.0, single=True),
}


@dataclass(frozen=True)
class Played:
    """What a program put out: samples, the texture that plays at the end of the sample's block."""

    samples: np.ndarray
    now: np.ndarray
    counters: list[float]


@dataclass(frozen=True)
class Program:
    """A program with one scene in it."""

    path: Path

    def play(
        self,
        hand: Hand,
        switches: Switches = (),
        *,
        block: int = 10**6,
        held: bool = False,
        number: int = 0,
        texture: int = 0,
    ) -> Played:
        words = [block, int(held), number, texture, *np.ravel(switches).astype(int)]
        done = subprocess.run(
            [self.path, *map(str, words)],
            input=hand[0].tobytes() + hand[1].tobytes(),
            capture_output=True,
            check=True,
        )
        values, count = np.frombuffer(done.stdout), hand[0].size
        return Played(values[:count], values[count : 2 * count], values[2 * count :].tolist())


def program_of(text: str, folder: Path, compiler: Sequence[str] = C) -> Program:
    """The program with a header of this text."""
    scene = re.findall(r"static const tq_scene (\w+) =", text)[0]
    (folder / "scene.h").write_text(text, encoding="utf-8")
    (folder / "program.c").write_text(PROGRAM, encoding="utf-8")
    defines = ['-DHEADER="scene.h"', f"-DSCENE={scene}", f"-DMEMORY={scene}_memory"]
    command = [*compiler, *EXACT, *defines, "program.c", "-o", "program", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return Program(folder / "program")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Program]:
    """The program of a case."""
    found: dict[str, Program] = {}

    def of(case: str) -> Program:
        if case not in found:
            text = scene_header("scene.h", case, CASES[case].rendered(), seed=SEED)
            found[case] = program_of(text, tmp_path_factory.mktemp("scene"))
        return found[case]

    return of


def stroke(rate_hz: float) -> Hand:
    """0.7 s: reversals, out of the grid, steps, lift-off by force, NaN and inf; exact in single
    precision."""
    time_s = np.arange(round(0.7 * rate_hz)) / rate_hz
    speed = 420 * np.sin(2 * np.pi * 3 * time_s)
    force = 2 + 2.4 * np.sin(2 * np.pi * 2.5 * time_s)
    share = time_s / time_s[-1]
    speed[(share > 0.4) & (share < 0.5)] = 180
    force[(share > 0.45) & (share < 0.6)] = 1.25
    speed[(share > 0.7) & (share < 0.72)] = np.nan
    force[(share > 0.8) & (share < 0.81)] = np.inf
    return speed.astype(np.float32).astype(float), force.astype(np.float32).astype(float)


def steady(rate_hz: float, seconds: float, *, speed: float = 150.0, force: float = 1.5) -> Hand:
    count = round(seconds * rate_hz)
    return np.full(count, speed), np.full(count, force)


def switches_of(rate_hz: float) -> list[tuple[int, int]]:
    """At rest and in motion, within fades, back and forth, within one update, to none that is."""
    text = """0:0 0.05:1 0.1:2 0.1006:1 0.15:2 0.2:3 0.2031:2 0.2052:3 0.25:1 0.2501:3 0.3:1 0.35:9
    0.4:-1 0.42:0 0.45:2 0.4504:0 0.5:3 0.5603:1 0.5651:0 0.6:1 0.603:0 0.64:2"""
    pairs = [word.split(":") for word in text.split()]
    return [(round(float(time_s) * rate_hz), int(texture)) for time_s, texture in pairs]


# --- What is expected, by Renderers alone ---------------------------------------------------------


def end_contact(renderer: Renderer) -> None:
    """No force from now on ends nothing any more: it is felt at once."""
    hand: Any = renderer._engine._state.hand  # type: ignore[attr-defined]
    hand.force = hand.force_slope = hand.force_turn = 0.0


@dataclass
class Reference:
    """A hand over the textures of a case, update by update, as docs/method/rendering.md says."""

    case: Case
    hand: Hand
    switches: Switches
    number: int = 0

    def __post_init__(self) -> None:
        self.plans = self.case.plans()
        self.samples = np.empty(self.hand[0].size)
        self.starts: list[tuple[int, int]] = [(0, 0)]  # sample at which a texture starts, which
        self.counted = np.zeros(3)  # above and below the grid, clamped
        self._begin(0)
        position = 0
        while position < self.samples.size:
            position += self._update(position)
        if self.case.restrained:
            limiter, compensator = Limiter(self.plans[0]), Compensator(self.plans[0])
            self.samples = np.array(limiter.limit(compensator.filter(self.samples.tolist())))
            self.touched = limiter.touched

    def _begin(self, texture: int) -> None:
        self.now, plan = texture, self.plans[texture]
        self.updates = 0  # of this texture so far
        stream = self.number * 2**32 + len(self.starts) - 1
        self.renderer = Renderer(
            MODELS[texture],
            rate_hz=plan.rate_hz,
            seed=SEED,
            stream=stream,
            update_samples=plan.update_samples,
            single=plan.single,
        )

    def _wanted(self, position: int) -> int:
        known = [to for at, to in self.switches if at <= position and 0 <= to < len(MODELS)]
        return known[-1] if known else self.starts[0][1]

    def _update(self, position: int) -> int:
        """One parameter update from a sample on; how many samples it lasts."""
        wanted = self._wanted(position)
        first = len(self.starts) > 1 and self.starts[-1][0] == position
        if wanted == self.now and not first:
            return self._rendered(position, lifted=False)
        before = self.counted.copy()
        count = self._rendered(position, lifted=True)
        # From 0 to 0; of a single sample the end alone is heard, so the one before tells (where it
        # is not among those that are interpolated).
        plan = self.plans[self.now]
        begin = position - 1 if plan.update_samples == 1 else position
        gone = not self.samples[max(0, begin) : position + count].any()
        if wanted == self.now or not gone:
            return count
        self.counted = before
        self.starts.append((position, wanted))
        self._begin(wanted)
        return self._rendered(position, lifted=True)

    def _rendered(self, position: int, *, lifted: bool) -> int:
        plan = self.plans[self.now]
        # Output samples for each update: of the first one for which the model makes its own.
        outputs = Fraction(plan.rate_hz) / 5000 * plan.own.update_samples
        begin, end = (math.ceil(n * outputs) for n in (self.updates, self.updates + 1))
        self.updates += 1
        here = slice(position, position + end - begin)
        speed, force = (part[here] for part in self.hand)
        was = self._counters()
        if lifted:
            end_contact(self.renderer)
        self.samples[here] = self.renderer.render(speed, np.zeros(force.size) if lifted else force)
        self.counted += self._counters() - was
        return speed.size

    def _counters(self) -> np.ndarray:
        counters = self.renderer.counters
        return np.array([counters.above_grid, counters.below_grid, counters.clamped], dtype=float)


@pytest.fixture(scope="module")
def expected() -> Callable[[str], Reference]:
    """The stroke with its switches in a case."""
    found: dict[str, Reference] = {}

    def of(case: str) -> Reference:
        rate_hz = CASES[case].rate_hz
        if case not in found:
            found[case] = Reference(CASES[case], stroke(rate_hz), switches_of(rate_hz))
        return found[case]

    return of


# --- Bits -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", CASES)
def test_a_scene_renders_what_python_renders(
    case: str, program: Callable[[str], Program], expected: Callable[[str], Reference]
) -> None:
    """Whatever the blocks: before, in and after every switch."""
    reference = expected(case)
    assert len(reference.starts) >= 8
    assert {texture for _, texture in reference.starts} == {0, 1, 2, 3}
    for block in (10**6, 1, 7, 256):
        played = program(case).play(reference.hand, reference.switches, block=block)
        assert np.array_equal(played.samples, reference.samples), block


@pytest.mark.parametrize("case", ["5 kHz", "48 kHz, restrained"])
def test_counters_go_on_over_switches(
    case: str, program: Callable[[str], Program], expected: Callable[[str], Reference]
) -> None:
    """A reading that is none counts also while a texture fades, for which the hand is lifted."""
    reference = expected(case)
    counters = program(case).play(reference.hand, reference.switches, block=64).counters
    lost = int((~np.isfinite(reference.hand).all(axis=0)).sum())
    assert counters[:4] == [lost, *reference.counted]
    assert min(counters[:4]) > 0
    assert counters[4:] == (reference.touched if CASES[case].restrained else [0, 0, 0])


def test_before_and_after_a_switch_at_rest_these_are_the_bits_of_renderers(
    program: Callable[[str], Program],
) -> None:
    """The same without the reference above: lifted off, a texture is gone at once."""
    speed, force = steady(5000.0, 0.6)
    force[1400:1505] = 0.0
    played = program("5 kHz").play((speed, force), [(1500, 1)])
    first, second = (
        Renderer(model, seed=SEED, stream=n, update_samples=period)
        for n, (model, period) in enumerate(zip(MODELS[:2], (5, 1), strict=True))
    )
    assert np.array_equal(played.samples[:1500], first.render(speed[:1500], force[:1500]))
    assert np.array_equal(played.samples[1500:], second.render(speed[1500:], force[1500:]))


def test_a_held_hand_is_one_that_is_given_at_each_sample(
    program: Callable[[str], Program],
) -> None:
    hand, switches = steady(5000.0, 0.2), [(300, 1), (310, 2), (700, 3)]
    given = program("5 kHz").play(hand, switches, block=32)
    held = program("5 kHz").play(hand, switches, block=32, held=True)
    assert np.array_equal(held.samples, given.samples)
    lost = np.full(hand[0].size, np.nan), hand[1]
    assert program("5 kHz").play(lost, switches, block=32, held=True).counters[0] == hand[0].size


def test_hands_of_other_numbers_have_other_noise(program: Callable[[str], Program]) -> None:
    hand, switches = steady(5000.0, 0.2), [(300, 1)]
    played = [program("5 kHz").play(hand, switches, number=number).samples for number in (0, 1)]
    assert np.array_equal(played[1], Reference(CASES["5 kHz"], hand, switches, 1).samples)
    assert abs(np.corrcoef(*played)[0, 1]) < 0.3


def test_a_hand_starts_on_any_texture(program: Callable[[str], Program]) -> None:
    hand = steady(5000.0, 0.1)
    on = [program("5 kHz").play(hand, texture=texture) for texture in (0, 3, 4, -1)]
    assert [played.now[0] for played in on] == [0, 3, 0, 0]
    rendered = Renderer(MODELS[3], seed=SEED, update_samples=10).render(*hand)
    assert np.array_equal(on[1].samples, rendered)


@pytest.mark.skipif(
    shutil.which("g++") is None, reason="g++ is not installed (see tools/system-packages)"
)
@pytest.mark.parametrize(
    "compiler",
    [CPP, [*CPP, "-DTQ_LANES=1"], [*C, "-DTQ_FREESTANDING"]],
    ids=["C++17", "C++17, one lane", "freestanding"],
)
def test_other_builds_render_the_same_bits(
    tmp_path: Path, compiler: list[str], expected: Callable[[str], Reference]
) -> None:
    case = "5 kHz, restrained"
    text = scene_header("scene.h", case, CASES[case].rendered(), seed=SEED)
    reference = expected(case)
    played = program_of(text, tmp_path, compiler).play(reference.hand, reference.switches)
    assert np.array_equal(played.samples, reference.samples)


# --- Switches -------------------------------------------------------------------------------------


def low(texture: str) -> TextureModel:
    """Without its noise, which has steps of its own."""
    model = planted_texture(texture)
    return replace(model, noise_gains=model.noise_gains * 1e-3)


def largest_step(samples: np.ndarray) -> float:
    return float(np.abs(np.diff(samples)).max())


CLICKS = {
    "as it is": ("", ""),
    "no fade": ("h->wanted != h->now && tq_scene_silent(h)", "h->wanted != h->now"),
}


@pytest.mark.parametrize("way", CLICKS)
def test_a_switch_does_not_click(tmp_path: Path, way: str) -> None:
    """Sixty switches make no larger step than ten seconds of a texture; without fades they do."""
    rendered = [(low(t), plan_for(5000.0, rate_hz=48_000.0)) for t in ("canvas", "PVC")]
    text = scene_header("scene.h", "low", rendered, seed=SEED)
    assert CLICKS[way][0] in text
    program = program_of(text.replace(*CLICKS[way]), tmp_path)
    at = range(1013, 58_000, 947)
    played = program.play(steady(48_000.0, 1.25), [(n, k % 2) for k, n in enumerate(at, start=1)])
    speed, force = steady(48_000.0, 10.0)
    steps = [largest_step(Renderer(m, rate_hz=48_000.0).render(speed, force)) for m, _ in rendered]
    assert (largest_step(played.samples) <= max(steps)) == (way == "as it is")


def test_a_texture_is_gone_within_5_ms_and_an_update(program: Callable[[str], Program]) -> None:
    """The next one starts at the first update that finds all gains at 0."""
    hand = steady(5000.0, 0.4)
    for texture, most in ((0, 30), (1, 26), (2, 64), (3, 30)):
        played = program("5 kHz").play(hand, [(1003, 0)], block=1, texture=texture)
        if texture == 0:
            assert not played.now.any()  # it plays already
            played = program("5 kHz").play(hand, [(1003, 1)], block=1)
        late = np.argmax(played.now != texture) - 1003
        assert 0 < late <= most
        silence = played.samples[1003 + late :][: 1 if texture == 0 else 5]
        assert not silence.any()  # its first update


def test_switching_back_within_a_fade_lets_the_texture_rise_again(
    program: Callable[[str], Program],
) -> None:
    hand = steady(5000.0, 0.3)
    played = program("5 kHz").play(hand, [(1000, 1), (1010, 0)], block=1)
    assert not played.now.any()
    renderer = Renderer(MODELS[0], seed=SEED)
    before = renderer.render(*(part[:1000] for part in hand))
    end_contact(renderer)
    off = renderer.render(hand[0][1000:1010], np.zeros(10))  # two updates of a millisecond
    after = renderer.render(*(part[1010:] for part in hand))
    assert np.array_equal(played.samples, np.concatenate([before, off, after]))


READ = """
#include <stdio.h>
#include <stdlib.h>
#include "read.h"

static tq_scene_hand hand;

static void on(tq_real *out, int count, int block)
{
    int n;
    for (n = 0; n < count; n += block)
        tq_scene_render_on(&hand, out + n, (size_t)(block < count - n ? block : count - n));
}

int main(int count, char **texts)
{
    static tq_real memory[SCENE_memory], out[200];
    const int block = atoi(texts[1]);
    const tq_real faster = (tq_real)atof(texts[2]);
    int n;
    (void)count;
    tq_scene_start(&hand, &SCENE, memory, 0, 0);
    tq_scene_read(&hand, 2.5, 120 + faster, 1.5);
    on(out, 50, block);
    tq_scene_switch(&hand, 1);
    on(out + 50, 10, block);
    tq_scene_read(&hand, 0.5, 125 + faster, 1.5);
    on(out + 60, 140, block);
    for (n = 0; n < 200; n++)
        printf("%a\\n", out[n]);
    printf("%a ", (double)hand.state.counters.above_grid);
    printf("%a\\n", (double)hand.state.counters.lift_offs);
    return 0;
}
"""


@pytest.fixture(scope="module")
def read_and_play(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., list[float]]:
    """Runs `READ`: its samples, then how many were above the grid, and without a reading."""
    folder, scene = tmp_path_factory.mktemp("read"), scene_identifier("read")
    rendered = [(model, plan_for(model.rate_hz)) for model in MODELS[:2]]
    (folder / "read.h").write_text(scene_header("read.h", "read", rendered, seed=SEED))
    (folder / "read.c").write_text(READ.replace("SCENE", scene))
    compiling = [*C, "-O2", "-ffp-contract=off", "read.c", "-o", "read", "-lm"]
    subprocess.run(compiling, check=True, cwd=folder)

    def run(*, block: int, faster: float) -> list[float]:
        words = [folder / "read", str(block), str(faster)]
        done = subprocess.run(words, check=True, capture_output=True, text=True)
        return [float.fromhex(number) for number in done.stdout.split()]

    return run


def test_readings_in_a_scene_have_equal_bits_and_counters_in_blocks_of_any_size(
    read_and_play: Callable[..., list[float]],
) -> None:
    whole = read_and_play(block=200, faster=380.0)
    assert whole[-2] > 100  # all but those after the reading was too old
    for block in (1, 2, 5, 7):
        assert read_and_play(block=block, faster=380.0) == whole


def test_readings_at_times_of_their_own_go_on_over_a_switch(
    read_and_play: Callable[..., list[float]],
) -> None:
    """Read while one texture fades, the hand strokes the next one, until the reading is too old.

    That begins at sample 75, after five updates, and is silent for one.
    """
    played = np.array(read_and_play(block=200, faster=0.0)[:200])
    first, second = (Renderer(MODELS[n], seed=SEED, stream=n) for n in (0, 1))
    first.read(120.0, 1.5, ago=2.5)
    assert np.array_equal(played[:50], first.render_on(50))
    assert np.array_equal(played[75:80], second.render_on(5))
    # Its change, by 5 mm/s within 62 samples, is the hand's slope per update of 5 samples.
    second.read(120.0, 1.5, ago=82.5)
    second.read(125.0, 1.5, ago=20.5)
    assert np.array_equal(played[80:], second.render_on(120))
    assert played[80:].any()


def test_limits_hold_for_what_leaves_whatever_plays(program: Callable[[str], Program]) -> None:
    """Switches every 30 ms are no pause of 20 ms, and begin no new window of the RMS."""
    hand = steady(5000.0, 0.6, speed=330.0, force=3.3)
    switches = [(n, k % 2) for k, n in enumerate(range(150, 3000, 150), start=1)]
    played = program("5 kHz, restrained").play(hand, switches)
    share = -np.expm1(-1 / (LIMITS.rms_window_s * 5000))
    running = np.sqrt(lfilter([share], [1, share - 1], played.samples**2))
    assert 0.045 < running.max() <= LIMITS.rms * (1 + 1e-12)
    assert np.abs(played.samples[:700]).max() > 0.1
    assert not played.samples[800:].any()  # 0.15 s of vibration
    assert min(played.counters[5:]) > 0


# --- Text -----------------------------------------------------------------------------------------


def arrays_in(text: str) -> list[list[str]]:
    """The numbers of each array of a header."""
    found = re.findall(r"static const tq_real \w+\[\] = \{(.*?)\};", text, re.DOTALL)
    return [re.findall(r"[^\s,]+", body) for body in found]


def pooled_bytes(rendered: Sequence[tuple[Any, RenderPlan]]) -> int:
    arrays = [np.asarray(a) for m, p in rendered for a in p.texture(m).values() if np.ndim(a)]
    distinct = {(array.dtype.str, array.tobytes()): array.nbytes for array in arrays}
    assert len(distinct) < len(arrays)
    return sum(distinct.values())


@pytest.mark.parametrize("case", ["5 kHz", "48 kHz", "5 kHz, single"])
def test_arrays_that_are_equal_are_held_once(case: str) -> None:
    rendered = CASES[case].rendered()
    arrays = arrays_in(scene_header("scene.h", case, rendered))
    assert len({tuple(array) for array in arrays}) == len(arrays)
    size = 4 if CASES[case].single else 8
    assert sum(map(len, arrays)) * size == pooled_bytes(rendered)


@pytest.mark.long("cross builds")
@pytest.mark.skipif(
    shutil.which("arm-none-eabi-gcc") is None,
    reason="arm-none-eabi-gcc is not installed (see tools/system-packages)",
)
def test_constants_on_a_micro_controller_are_the_arrays_and_the_structures(
    tmp_path: Path,
) -> None:
    """On a Cortex-M4 in single precision nothing else is read-only data, or writable at all."""
    rendered = CASES["5 kHz, single"].rendered()
    text = scene_header("scene.h", "m", rendered)
    source = '#include "scene.h"\nconst tq_scene *const kept = &scene_m;\n'
    source += "char texture[sizeof(tq_texture)], scene[sizeof(tq_scene) + sizeof kept];\n"
    source += "char hand[sizeof(tq_scene_hand)];\n"
    (tmp_path / "scene.h").write_text(text, encoding="utf-8")
    (tmp_path / "program.c").write_text(source, encoding="utf-8")
    m4 = ["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", *EXACT]
    freestanding = ["-std=c99", "-DTQ_FREESTANDING", "-ffreestanding", "-fno-common", *STRICT]
    command = ["arm-none-eabi-gcc", *m4, *freestanding, "-c", "program.c", "-o", "program.o"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    names = subprocess.run(
        ["arm-none-eabi-nm", "-S", "program.o"], cwd=tmp_path, capture_output=True, text=True
    ).stdout
    sizes = {name: int(size, 16) for size, name in re.findall(r"^\w+ (\w+) \w (\w+)$", names, re.M)}
    sections = subprocess.run(
        ["arm-none-eabi-size", "-A", "program.o"], cwd=tmp_path, capture_output=True, text=True
    ).stdout
    constant = sum(map(int, re.findall(r"^\.rodata\S*\s+(\d+)", sections, re.M)))
    structures = len(rendered) * sizes["texture"] + sizes["scene"]
    assert 0 <= constant - structures - pooled_bytes(rendered) < 8  # alignment
    assert sum(map(int, re.findall(r"^\.data\S*\s+(\d+)", sections, re.M))) == 0
    assert sizes["hand"] < 300


def test_a_hand_has_the_memory_of_the_neediest_texture(tmp_path: Path) -> None:
    """The one has more layers, the other, made at a lower rate, is interpolated."""
    many = planted_texture("canvas")
    slow = many.at_rate(4000.0).with_layers([0])
    for order in ([many, slow], [slow, many], [many, many]):
        rendered = [(model, plan_for(model.rate_hz, rate_hz=many.rate_hz)) for model in order]
        text = scene_header("scene.h", "m", rendered)
        lengths = [(m.n_layers, p.texture(m).get("up", 0)) for m, p in rendered]
        needed = [f"TQ_MEMORY({layers}, {up})" for layers, up in lengths]
        checks = " && ".join(f"scene_m_memory >= {one}" for one in needed)
        equals = " || ".join(f"scene_m_memory == {one}" for one in needed)
        source = f'#include "scene.h"\nchar right[(({checks}) && ({equals})) ? 1 : -1];\n'
        (tmp_path / "scene.h").write_text(text, encoding="utf-8")
        (tmp_path / "program.c").write_text(source, encoding="utf-8")
        command = [*C, *EXACT, "-c", "program.c", "-o", "program.o"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_the_program_in_the_comment_runs(tmp_path: Path) -> None:
    rendered = CASES["5 kHz"].rendered()[:2]
    text = scene_header("it's 1.h", "a scene", rendered, seed=3)
    (tmp_path / "it's 1.h").write_text(text, encoding="utf-8")
    example = re.search(r"^ {7}#include <stdio.h>\n.*?^ {7}\}\n", text, re.DOTALL | re.MULTILINE)
    assert example is not None
    (tmp_path / "program.c").write_text(example[0], encoding="utf-8")
    command = [*C, *EXACT, "program.c", "-o", "program", "-lm"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    run = subprocess.run([tmp_path / "program"], capture_output=True, text=True, check=True)
    printed = np.array(run.stdout.split(), dtype=float)
    expected = Renderer(MODELS[0], seed=3).render(50.0, 0.5, samples=500)
    assert printed[:500] == pytest.approx(expected, rel=1e-8)
    assert printed.size == 1000
    assert printed[600:].any()


def test_a_header_says_what_it_is() -> None:
    model = replace(planted_texture("canvas"), simulated=False, texture='7*/ #error "')
    rendered = [(MODELS[1], plan_for(5000.0)), (model, plan_for(5000.0, update_samples=1))]
    text = scene_header("a.h", "it's */ 1", rendered, seed=3, note="GFC ≥ 0.95 */\nto 5 kHz")
    comment = text.split("*/")[0]
    for words in (
        'Scene "it\'s * / 1", 2 textures',
        "output in g at 5000 Hz, seed 3",
        "GFC ≥ 0.95 * /\n   to 5 kHz",
        'scene_it_s____1_texture_MDF: "MDF", simulated\n       3 layers ("planted")',
        '"7* / #error \\"", from recordings\n       4 layers',
        "updated every 5 samples",
        "updated every sample",
        *(f"SHA-256 {m.sha256}" for m, _ in rendered),
        "Not compensated for a vibrator. Limits: none.",
        "SPDX-License-Identifier: GPL-3.0-or-later",
        "The numbers of the textures are data of those whose models they are",
    ):
        assert words in comment
    told = scene_header("a.h", "s", CASES["5 kHz, restrained"].rendered()).split("*/")[0]
    assert "resonance at 80 Hz. Limits: peak 0.3 g, RMS 0.05 g, duration 0.15 s." in told


def test_textures_whose_names_are_alike_have_indices_of_their_own() -> None:
    names = ["a b", "a-b", "a b 2", "a_b", "é"]
    rendered = [(replace(planted_texture("PVC"), texture=n), plan_for(5000.0)) for n in names]
    text = scene_header("a.h", "s", rendered)
    found = re.findall(r"^ {4}(scene_s_\w+),?$", text, re.M)
    ends = ["a_b", "a_b_2", "a_b_2_2", "a_b_3", "_"]
    assert found == [*(f"scene_s_texture_{end}" for end in ends), "scene_s_count"]
    assert scene_identifier("s") == "scene_s"


def test_two_scenes_of_one_name_are_not_confused(tmp_path: Path) -> None:
    for header, seed in (("a.h", 1), ("b.h", 2)):
        text = scene_header(header, "s", CASES["5 kHz"].rendered(), seed=seed)
        (tmp_path / header).write_text(text, encoding="utf-8")
    for other, right in (("a.h", True), ("b.h", False)):
        both = f'#include "a.h"\n#include "{other}"\n'
        (tmp_path / "program.c").write_text(both, encoding="utf-8")
        command = ["gcc", "-std=c99", "-fsyntax-only", "program.c"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode == 0) == right
        assert right or "redefinition of" in done.stderr


CANVAS, MDF = MODELS[:2]
PLAN = plan_for(5000.0)
COMPENSATION = compensation_for(planted_vibrator(), rate_hz=5000.0)
LOUD = replace(planted_texture("canvas"), gains=planted_texture("canvas").gains * 1e307)
BOTH = ["MDF", "canvas"]
REFUSED = [
    ([], "texture", "none"),
    ([(CANVAS, PLAN), (MDF, plan_for(5000.0, rate_hz=48_000.0))], "rate", BOTH),
    ([(CANVAS, PLAN), (MDF, plan_for(5000.0, single=True))], "precision", BOTH),
    ([(CANVAS, PLAN), (MDF, plan_for(5000.0, compensation=COMPENSATION))], "compensation", BOTH),
    ([(CANVAS, PLAN), (MDF, plan_for(5000.0, limits=Limits(peak=1.0)))], "limits", BOTH),
    ([(CANVAS, PLAN), (replace(planted_texture("MDF"), unit="arbitrary"), PLAN)], "unit", BOTH),
    ([(CANVAS, plan_for(5000.0, rate_hz=1e6))], "768000 Hz", "1e+06"),
    ([(MDF, PLAN), (LOUD, PLAN)], ["gains", "2e+306 g", "double"], "1.77e+307 g"),
]


@pytest.mark.parametrize(("rendered", "expected", "got"), REFUSED)
def test_what_is_no_scene_is_refused(rendered: Any, expected: object, got: object) -> None:
    with refused(InputError, expected=expected, got=got):
        scene_header("a.h", "s", rendered)


def test_a_seed_out_of_range_is_refused() -> None:
    with refused(InputError, expected="seed", got=-1):
        scene_header("a.h", "s", [(CANVAS, PLAN)], seed=-1)
