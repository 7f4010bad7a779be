"""The player (`player.h`), from C: scripts against a model in Python, races, limits, symbols."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactileq.modeling.rendering

HERE = Path(__file__).parent
HEADERS = Path(tactileq.modeling.rendering.__file__).parent
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
LANGUAGES = {
    "C11": ["gcc", "-std=c11"],
    "C99": ["gcc", "-std=c99"],
    "C++17": ["g++", "-x", "c++", "-std=c++17"],
}
NO_LIMITS = (0, 0, 0, 0, 0, 0)
BEAT = 16  # samples from reading to reading of player_script.c
FADE = 25

Compile = Callable[..., Path]
Events = Sequence[tuple[int, str]]
Array = np.ndarray[Any, np.dtype[Any]]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Compile:
    """Compiles a program of this folder with these options; the program's path."""
    folder = tmp_path_factory.mktemp("programs")

    def compiled(program: str, *options: str) -> Path:
        target = folder / " ".join([program, *options]).replace("/", "")
        if not target.exists():
            command = ["gcc", "-std=c11", "-ffp-contract=off", *WARNINGS, *options, f"-I{HEADERS}"]
            source = str(HERE / f"{program}.c")
            subprocess.run([*command, source, "-o", target, "-lm", "-pthread"], check=True)
        return target

    return compiled


@pytest.fixture(scope="module")
def play(build: Compile) -> Callable[..., Array]:
    """Plays a script; what leaves, in single precision."""
    program = build("player_script", "-O2")

    def played(
        events: Events,
        samples: int,
        *,
        block: int = 32,
        fade: int = FADE,
        limits: Sequence[float] = NO_LIMITS,
    ) -> Array:
        numbers = [*limits, fade, block, samples]
        words = [*map(str, numbers), *(f"{at}:{what}" for at, what in events)]
        run = subprocess.run([program, "play", *words], check=True, capture_output=True)
        out = np.frombuffer(run.stdout, dtype=np.float32)
        assert out.size == samples
        return out

    return played


# --- A model of the player ------------------------------------------------------------------------


@dataclass
class Model:
    """Which voice plays at which level at every sample, by the words of `player.h`."""

    fade: int = FADE
    wanted: str | None = None
    playing: str | None = None
    level: int = 0
    generations: dict[str, int] = field(default_factory=lambda: dict.fromkeys("ABC", 0))
    timeline: list[tuple[tuple[str, int] | None, int]] = field(default_factory=list)
    starts: list[bool] = field(default_factory=list)

    def happen(self, what: str) -> None:
        """An event of a script, but the hand's."""
        voice = what.upper()
        if what.islower() and voice not in (self.wanted, self.playing):
            self.generations[voice] += 1
        self.wanted = None if what == "-" else voice

    def sample(self) -> None:
        """One more sample."""
        self.starts.append(self.playing is None)
        if self.playing is None:
            self.playing = self.wanted
        if self.playing is None:
            self.timeline.append((None, 0))
            return
        self.level += 1 if self.playing == self.wanted else -1
        self.level = min(self.level, self.fade)
        self.timeline.append(((self.playing, self.generations[self.playing]), self.level))
        if self.level == 0:
            self.playing = None


def expected(program: Path, events: Events, samples: int, *, fade: int = FADE) -> Array:
    """A script without limits: every voice by itself, from `tq_render_on`, times its gain."""
    model, hand = Model(fade=fade), np.empty((samples, 3))
    happening = {n: [what for _, what in group] for n, group in groupby(events, lambda e: e[0])}
    speed, read = 0.0, 0
    for n in range(samples):
        for what in happening.get(n, []):
            if what[0].isdigit():
                speed = float(what)
            else:
                model.happen(what)
        model.sample()
        if n % BEAT == 0 or n in happening:
            read = n
        looks = model.starts[n] or read == n
        hand[n] = model.starts[n], n - read if looks else -1, speed
    out = np.zeros(samples)
    for voice in {voice for voice, _ in model.timeline if voice}:
        where = np.array([sounding == voice for sounding, _ in model.timeline])
        name = [str("ABC".index(voice[0])), str(voice[1])]
        arguments = [str(program), "render", *map(str, NO_LIMITS), *name]
        run = subprocess.run(
            arguments, input=hand[where].tobytes(), check=True, capture_output=True
        )
        out[where] = np.frombuffer(run.stdout)
    level = np.array([level for _, level in model.timeline])
    gain = np.where(level == fade, 1, level * (1 / fade))
    return (out * gain).astype(np.float32)


SCRIPT: Events = [(0, "100"), (0, "A"), (500, "B"), (900, "-"), (1300, "c"), (1600, "180")]
INTERRUPTIONS: Events = [
    *((0, "100"), (0, "A"), (0, "B"), (100, "A")),  # replaced before it began
    *((300, "B"), (310, "A")),  # wanted again while it fades out
    *((500, "-"), (524, "A"), (600, "-"), (625, "A"), (700, "-"), (726, "A")),  # at its end
    *((800, "B"), (830, "-"), (835, "B"), (840, "C")),  # stopped while it fades in
    *((1000, "B"), (1010, "c"), (1020, "b"), (1100, "b"), (1300, "A"), (1310, "-"), (1311, "a")),
]


def random_script(seed: int, samples: int) -> Events:
    """Events at random samples, many of them within a fade of each other."""
    rng = np.random.default_rng(seed)
    gaps = np.where(
        rng.random(200) < 0.7, rng.integers(0, FADE + 5, 200), rng.integers(0, 300, 200)
    )
    times = np.cumsum(gaps)
    words = rng.choice([*"ABCabc-", "30", "100", "0"], size=times.size)
    return [(int(at), str(word)) for at, word in zip(times, words, strict=True) if at < samples]


@pytest.mark.parametrize(
    "events", [SCRIPT, INTERRUPTIONS, *(random_script(s, 6000) for s in (1, 2))]
)
def test_what_leaves_are_the_kernels_bits_times_the_fade(
    play: Callable[..., Array], build: Compile, events: Events
) -> None:
    wanted = expected(build("player_script", "-O2"), events, 6000)
    assert np.count_nonzero(wanted) > 1000
    assert np.array_equal(play(events, 6000), wanted)


@pytest.mark.parametrize("fade", [0, 1, 2, 64, 1000])
def test_fades_of_any_length(play: Callable[..., Array], build: Compile, fade: int) -> None:
    wanted = expected(build("player_script", "-O2"), SCRIPT, 4000, fade=max(fade, 1))
    assert np.array_equal(play(SCRIPT, 4000, fade=fade), wanted)


LIMITS = (0.2, 0.005, 0.02, 400, 100, 0.01)  # peak, mean square, its share, longest, pause, silence


@pytest.mark.parametrize("limits", [NO_LIMITS, LIMITS])
@pytest.mark.parametrize("seed", [3, 4])
def test_blocks_of_any_size_have_equal_bits(
    play: Callable[..., Array], seed: int, limits: Sequence[float]
) -> None:
    events = random_script(seed, 6000)
    outs = [play(events, 6000, block=block, limits=limits) for block in (1, 7, 64, 100, 6000)]
    assert np.count_nonzero(outs[0]) > 1000
    assert all(np.array_equal(out, outs[0]) for out in outs)


def test_a_stop_ends_in_zeros_and_a_swap_in_the_other_voice_after_one_fade(
    play: Callable[..., Array],
) -> None:
    out = play(SCRIPT, 2000)
    alone = play([(0, "100"), (0, "B")], 500)
    assert np.array_equal(out[500 + FADE : 900], alone[: 900 - 500 - FADE])
    assert out[900 + FADE - 2] != 0
    assert not out[900 + FADE - 1 : 1300].any()
    assert out[1300] != 0


# --- Limits across swaps --------------------------------------------------------------------------


def running_mean_squares(out: Array, share: float) -> Array:
    """The running mean square behind every sample."""
    value, values = 0.0, []
    for square in out.astype(float) ** 2:
        value += share * (square - value)
        values.append(value)
    return np.array(values)


def longest_vibration(out: Array, pause: int, silence: float) -> int:
    """From the first sample above `silence` to the last, of vibration without a pause."""
    loud = np.flatnonzero(np.abs(out) > silence)
    strokes = np.split(loud, np.flatnonzero(np.diff(loud) > pause) + 1)
    return max(int(stroke[-1] - stroke[0]) + 1 for stroke in strokes)


@pytest.mark.parametrize("fade", [1, 5, FADE, 200])
def test_limits_hold_across_swaps(play: Callable[..., Array], fade: int) -> None:
    """Fades make samples smaller and never the limits' memory; a new voice takes it over."""
    peak, mean_square, share, longest, pause, silence = LIMITS
    rounding = 1 + 2.0**-22  # of single precision, squared
    seen = []
    for seed in range(10, 18):
        events = [(0, "180"), *(e for e in random_script(seed, 8000) if not e[1].isdigit())]
        free, out = (play(events, 8000, fade=fade, limits=which) for which in (NO_LIMITS, LIMITS))
        squares = running_mean_squares(out, share)
        loudest = running_mean_squares(free, share).max()
        assert longest_vibration(free, pause, silence) > longest
        seen.append((np.abs(free).max(), loudest, squares.max()))
        assert np.abs(out).max() <= np.float32(peak)
        assert squares.max() <= mean_square * rounding
        assert longest_vibration(out, pause, silence) <= longest
    over_peak, over_square, reached = np.max(seen, axis=0)
    assert over_peak > 1.2 * peak  # there was something to limit
    assert over_square > 1.5 * mean_square
    assert reached > 0.99 * mean_square


def test_silence_between_voices_is_a_pause_and_lets_the_mean_square_decay(
    play: Callable[..., Array],
) -> None:
    """After a pause of the player a voice is as loud as a first one; without, it stays muted."""
    duration = (0, 0, 0, 400, 100, 1e-6)  # so low that no sample is silent by chance
    for silent, sounds in ((99, False), (100, True), (5000, True)):
        again = 600 + FADE + silent
        events = [(0, "180"), (0, "A"), (600, "-"), (again, "B")]
        out = play(events, again + 300, limits=duration)
        assert out[:400].any()
        assert not out[430:again].any()
        assert out[again:].any() == sounds
    again = 600 + FADE + 90  # shorter than a pause, but the voice before was silent at its end, too
    events = [(0, "180"), (0, "A"), (550, "0"), (600, "-"), (again, "180"), (again, "B")]
    assert play(events, again + 300, limits=duration)[again:].any()
    rms = (0, 0.005, 0.005, 0, 0, 0)
    later, sooner, first = (
        play([(0, "180"), *events], 6000, limits=rms)
        for events in (
            [(0, "A"), (600, "-"), (5000, "B")],
            [(0, "A"), (600, "B")],
            [(0, "B")],
        )
    )
    assert np.allclose(later[5000:], first[:1000], rtol=1e-6, atol=0)
    assert not np.allclose(sooner[600 + FADE : 1000], first[: 400 - FADE], rtol=1e-3, atol=0)


# --- Threads --------------------------------------------------------------------------------------

RACES = {
    "two threads": (["-O2"], 200_000),
    "two threads, watched for races": (["-O1", "-g", "-fsanitize=thread"], 60_000),
    "interleaved, memory watched": (["-O1", "-g", "-fsanitize=address", "-DINTERLEAVED"], 60_000),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("two threads", marks=pytest.mark.long("as watched for races, but for longer")),
        "two threads, watched for races",
        "interleaved, memory watched",
    ],
)
def test_nobody_touches_a_freed_voice_and_nothing_clicks(build: Compile, name: str) -> None:
    options, samples = RACES[name]
    program = build("player_races", *options)
    run = subprocess.run([program, str(samples)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    seen = {name: float(value) for name, value in map(str.split, run.stdout.splitlines())}
    print(f"\n{name}:", seen)
    assert seen["samples"] >= samples
    assert seen["freed"] > 50
    assert min(seen["silences"], seen["plateaus"]) > 10
    assert seen["not_finite"] == seen["not_silent"] == 0
    # |g' y' - g y| <= |y' - y| + |y| |g' - g|, where the gain moves by 1 / fade
    bound = seen["steepest"] + seen["largest"] / seen["fade"]
    assert bound < seen["largest"] / 4  # a click would be noticed
    assert 0 < seen["step"] <= bound * (1 + 1e-6)


# --- Compilers ------------------------------------------------------------------------------------


def example() -> str:
    """The example in the header's comment."""
    text = (HEADERS / "player.h").read_text(encoding="utf-8")
    found = re.search(r"^ {7}#include.*?(?=^ {3}\S)", text, re.DOTALL | re.MULTILINE)
    assert found
    return found[0]


@pytest.mark.parametrize(
    ("language", "precision"),
    [("C11", "double"), ("C99", "float"), ("C++17", "double"), ("C++17", "float")],
)
def test_the_headers_example_calls_nothing_but_square_roots_and_copies(
    tmp_path: Path, language: str, precision: str
) -> None:
    source, target = tmp_path / "example.c", tmp_path / "example.o"
    source.write_text(example(), encoding="utf-8")
    options = ["-O2", "-fno-stack-protector", *WARNINGS, f"-I{HEADERS}", f"-DTQ_REAL={precision}"]
    command = [*LANGUAGES[language], *options, "-c", str(source), "-o", str(target)]
    subprocess.run(command, check=True)
    symbols = subprocess.run(["nm", target], check=True, capture_output=True, text=True).stdout
    defined = set(re.findall(r" [Tt] (\w+)", symbols))
    called = set(re.findall(r" U (\w+)", symbols)) - {"_GLOBAL_OFFSET_TABLE_"}
    hand = {name for name in called if "hand" in name}
    assert any("callback" in name for name in defined)
    assert len(hand) == 1
    root = "sqrt" if precision == "double" else "sqrtf"
    assert called - hand <= {root, "memcpy", "memmove", "memset"}


def test_both_kinds_of_atomics_have_equal_bits(play: Callable[..., Array], build: Compile) -> None:
    """C11's and, for C99 and C++17, the compiler's."""
    program = build("player_script", "-O2", "-std=c99")
    words = [*map(str, NO_LIMITS), str(FADE), "32", "3000", *(f"{n}:{e}" for n, e in SCRIPT)]
    run = subprocess.run([program, "play", *words], check=True, capture_output=True)
    assert run.stdout == play(SCRIPT, 3000).tobytes()
