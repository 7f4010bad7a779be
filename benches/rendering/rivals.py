"""What the render bench compares: the kernel, its rivals in C (`rivals.h`), and scipy's filters."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter, sosfilt

from tactileq.benches.rendering.coefficients import CoefficientTable
from tactileq.benches.rendering.stored_sounds import Grains, Loops
from tactileq.modeling import ARModel, InputError, Spectrum, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import counted
from tactileq.modeling.fitting.autoregressive import fit_filter
from tactileq.modeling.models.line_spectral import line_spectral_frequencies
from tactileq.modeling.rendering.compiled import CompiledEngine, filled_texture
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import LayeredModel, plan_for
from tactileq.stimuli.planted.textures import FORCES_N, SPEEDS_MM_S

RATE_HZ = 5000.0
ORDER = 20
KERNEL, DIRECT_FORM_I, TRANSPOSED = "kernel", "direct form I", "direct form II"
TPT, AR = "TPT", f"AR({ORDER})"
RIVAL_FORMS = (DIRECT_FORM_I, TRANSPOSED)
COMPILED = (KERNEL, DIRECT_FORM_I, TRANSPOSED, TPT, AR)
COEFFICIENTS, BANDS = "coefficients", "bands by their coefficients"
_KINDS = {DIRECT_FORM_I: 0, TRANSPOSED: 1, TPT: 2, AR: 3, COEFFICIENTS: 3, BANDS: 4}
_SPECTRUM_SAMPLES = 5000


def compiled_parts(name: str) -> tuple[Any, Any]:
    """The cffi pair (ffi, lib) of a compiled module, such as `tactileq.modeling.rendering._kernel`.

    Raises
    ------
    InputError
        Where they were not compiled at installation.
    """
    try:
        module = import_module(name)
    except ImportError as error:
        raise InputError(
            f"expected the compiled {name}, got none; install a C compiler, then tactileq again."
        ) from error
    return module.ffi, module.lib


def layered_texture(layers: int) -> TextureModel:
    """A texture of so many layers on the default grid, whose parameters all move with the hand.

    Layers lie evenly on a logarithmic scale from 40 to 1500 Hz, with signs that alternate.
    """
    speed, force = SPEEDS_MM_S[:, None, None] / 200, FORCES_N[:, None] / 2
    centre = np.geomspace(40.0, 1500.0, layers)
    signs = (-1.0) ** np.arange(layers)
    grid = np.ones((SPEEDS_MM_S.size, FORCES_N.size, layers))
    return TextureModel(
        texture=counted(layers, "layer"),
        rate_hz=RATE_HZ,
        speeds_mm_s=SPEEDS_MM_S,
        forces_n=FORCES_N,
        noise_gains=0.02 * grid[..., 0] * speed[..., 0] ** 0.5,
        frequencies_hz=centre * speed**0.1 * force**0.02 * grid,
        bandwidths_hz=(15 + 0.1 * centre) * force**0.2 * grid,
        gains=0.2 * signs * speed**0.5 * force**0.3 * grid,
        level_sd_db=0 * grid,
        estimator="planted",
        simulated=True,
    )


def predictor_of(texture: TextureModel) -> ARModel:
    """The autoregressive model of order 20 of a texture's own responses, condition by condition."""
    frequency = np.linspace(0.0, texture.rate_hz / 2, _SPECTRUM_SAMPLES // 2 + 1)
    grid = (texture.speeds_mm_s.size, texture.forces_n.size)
    found, gains = np.empty((*grid, ORDER)), np.empty(grid)
    for i, j in np.ndindex(grid):
        peq = texture.peq(float(texture.speeds_mm_s[i]), float(texture.forces_n[j]))
        # A mean magnitude, as a spectrum holds, is by √π/2 below the root of the mean power.
        magnitude = peq.response(frequency) * 2 / np.sqrt(np.pi)
        expected = Spectrum(frequency, magnitude, texture.rate_hz, _SPECTRUM_SAMPLES)
        fitted = fit_filter([expected], order=ORDER)
        found[i, j] = line_spectral_frequencies(fitted.coefficients)
        gains[i, j] = fitted.gain
    return ARModel(
        texture=texture.texture,
        rate_hz=texture.rate_hz,
        speeds_mm_s=texture.speeds_mm_s,
        forces_n=texture.forces_n,
        line_spectral_frequencies=found,
        gains=gains,
        level_sd_db=np.zeros(grid),
        simulated=texture.simulated,
    )


class ProductsAndSums(NamedTuple):
    """What a form needs for each sample, beside the noise: its products and its sums."""

    products: int
    sums: int


def operations(name: str, layers: int) -> ProductsAndSums:
    """Of one of `COMPILED` with so many layers and the noise branch (`kernel.h`, `rivals.h`)."""
    if name == AR:
        return ProductsAndSums(ORDER + 1, ORDER)
    products, sums = {KERNEL: (7, 9), DIRECT_FORM_I: (3, 3), TRANSPOSED: (3, 4), TPT: (5, 6)}[name]
    of_branch = {KERNEL: (1, 1), DIRECT_FORM_I: (1, 1)}.get(name, (1, 0))  # a gain's ramp; x - x''
    return ProductsAndSums(products * layers + of_branch[0], sums * layers + of_branch[1])


class CompiledStream:
    """The kernel or one of its rivals in C, called without anything of Python around it.

    Parameters
    ----------
    name : str
        One of `COMPILED`, or `COEFFICIENTS` or `BANDS`.
    model : LayeredModel
        At most 40 layers, rendered at its own rate (the kernel: at any); a `CoefficientTable` for
        `AR` and `COEFFICIENTS`, a `BandTable` for `BANDS`.
    seed : int
        Of the noise.
    rate_hz : float, optional
        The model's by default.
    """

    def __init__(
        self,
        name: str,
        model: LayeredModel,
        *,
        update_samples: int,
        seed: int,
        rate_hz: float | None = None,
    ) -> None:
        self._ffi, lib = compiled_parts("tactileq.benches.rendering._rivals")
        key = stream_key(seed)
        plan = plan_for(model.rate_hz, rate_hz=rate_hz, update_samples=update_samples)
        # Kept, because it owns what the texture points at.
        self._engine = CompiledEngine(model, plan, key=key)
        # Of another cffi module; the structures are the same, from the same header.
        self._texture = self._engine_pointer("tq_texture *", self._engine._texture)
        if name == KERNEL:
            self._state = self._engine_pointer("tq_state *", self._engine._state)
            self._call = lib.tq_kernel_calls
        else:
            state = {"kind": _KINDS[name], "key": int(key)}
            if isinstance(model, CoefficientTable):
                state |= {"poles": model.poles, "zeros": model.zeros}
            self._state = self._ffi.new("tq_rival *", state)
            self._call = lib.tq_rival_calls

    def _engine_pointer(self, kind: str, pointer: Any) -> Any:
        return self._ffi.cast(kind, int(self._engine._ffi.cast("uintptr_t", pointer)))

    @property
    def kernel_bytes(self) -> int:
        """What one stream of the kernel needs beside the model's table."""
        engine = self._engine
        sizes = map(engine._ffi.sizeof, (engine._texture[0], engine._state[0], engine._memory))
        return sum(sizes)

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats:
        """The next samples for (n,) speeds and forces, both float64."""
        output = np.empty(speed_mm_s.size)
        self.calls(speed_mm_s, force_n, output, block=output.size)()
        return output

    def calls(
        self, speed_mm_s: Floats, force_n: Floats, output: Floats, *, block: int
    ) -> Callable[[], None]:
        """What renders into `output`, (n,), by a call within C for each `block` samples."""
        speed, force, out = (
            self._ffi.from_buffer("double[]", array) for array in (speed_mm_s, force_n, output)
        )
        calls = partial(self._call, self._texture, self._state, speed, force, out)

        def run(stream: CompiledStream = self) -> None:  # keeps what the pointers point at
            calls(output.size, max(block, 1))

        return run


class SoundStream:
    """Stored sounds played by C (`sounds.h`), called without anything of Python around it.

    Parameters
    ----------
    sounds : Loops or Grains
        Grains have a hand of their own interval, half a block.
    seed : int
        Of the places from which grains are taken; loops always start at their beginning.
    """

    def __init__(self, sounds: Loops | Grains, *, update_samples: int, seed: int) -> None:
        self._ffi, lib = compiled_parts("tactileq.benches.rendering._rivals")
        plan = plan_for(sounds.rate_hz, update_samples=update_samples)
        self._texture, self._arrays = filled_texture(self._ffi, plan.texture(sounds), np.float64)
        samples = np.ascontiguousarray(sounds.samples)
        state = {"sounds": self._ffi.from_buffer("int16_t[]", samples), "length": sounds.length}
        if isinstance(sounds, Grains):
            window = sounds.window
            state |= {"window": self._ffi.from_buffer("double[]", window), "grain": sounds.block}
            self._arrays += [window]
            self._state = self._ffi.new("tq_grains *", state | {"drawn": int(stream_key(seed))})
            self._call = lib.tq_grains_render
        else:
            self._state, self._call = self._ffi.new("tq_loops *", state), lib.tq_loops_render
        self._arrays += [samples, *state.values()]

    def render(self, speed_mm_s: Floats, force_n: Floats) -> Floats:
        """The next samples for (n,) speeds and forces, both float64."""
        output = np.empty(speed_mm_s.size)
        self.calls(speed_mm_s, force_n, output)()
        return output

    def calls(self, speed_mm_s: Floats, force_n: Floats, output: Floats) -> Callable[[], None]:
        """What renders into `output`, (n,), in one call."""
        arrays = [self._ffi.from_buffer("double[]", x) for x in (speed_mm_s, force_n, output)]
        return lambda: self._call(self._texture, self._state, *arrays, output.size)


class SosfiltStream:
    """A sum of bands by `scipy.signal.sosfilt`, one call per layer and block.

    What a good user of numpy would write: parameters by bilinear interpolation once per block,
    coefficients of all layers at once, one call per layer, as the layers' coefficients differ.

    Parameters
    ----------
    model : LayeredModel
        Rendered at its own rate.
    rng : numpy.random.Generator
        Draws the noise of `render`.
    """

    def __init__(self, model: LayeredModel, rng: np.random.Generator) -> None:
        table = model.table
        self._values, self._angle, self._rng = table.values, np.pi / model.rate_hz, rng
        self._speeds, self._forces = table.speeds_mm_s.tolist(), table.forces_n.tolist()
        self._sections = np.zeros((table.n_layers, 6))
        self._sections[:, 3] = 1.0
        self._states = np.zeros((table.n_layers, 2))

    def render(self, speed_mm_s: float, force_n: float, count: int) -> Floats:
        """The next block: uniform noise of unit variance through the bands."""
        noise = self._rng.random(count)
        noise -= 0.5
        noise *= np.sqrt(12)
        return self.filter(noise, speed_mm_s, force_n=force_n)

    def filter(self, noise: Floats, speed_mm_s: float, *, force_n: float) -> Floats:
        """The next block, (n,), of this noise (n,) for the hand as it is at its first sample."""
        values = self._at(abs(speed_mm_s), force_n)
        frequency, bandwidth, gain = values[1:].reshape(3, -1)
        k = np.tan(self._angle * bandwidth)
        share = 1 / (1 + k)
        sections = self._sections
        sections[:, 0] = gain * k * share
        sections[:, 2] = -sections[:, 0]
        sections[:, 4] = -2 * np.cos(2 * self._angle * frequency) * share
        sections[:, 5] = (1 - k) * share
        output: Floats = values[0] * noise
        for layer in range(len(sections)):
            output += self._band(layer, noise)
        return output

    def _band(self, layer: int, noise: Floats) -> Floats:
        sections = self._sections[layer : layer + 1]
        state = self._states[layer : layer + 1]
        band: Floats
        band, self._states[layer] = sosfilt(sections, noise, zi=state)
        return band

    def _at(self, speed: float, force: float) -> Floats:
        """Noise gain, frequencies, bandwidths and gains for this hand.

        docs/method/rendering.md#grid-edges
        """
        ramp = min(speed / self._speeds[0], 1.0) * min(max(force / self._forces[0], 0.0), 1.0)
        i, x = _cell(self._speeds, speed)
        j, y = _cell(self._forces, force)
        (near, strong), (fast, both) = self._values[i : i + 2, j : j + 2]
        values: Floats = (near * (1 - x) + fast * x) * (1 - y) + (strong * (1 - x) + both * x) * y
        values[0] *= ramp
        values[1 + 2 * len(self._sections) :] *= ramp
        return values


class LfilterStream(SosfiltStream):
    """The same by `scipy.signal.lfilter`, whose call costs less."""

    def _band(self, layer: int, noise: Floats) -> Floats:
        section, state = self._sections[layer], self._states[layer]
        band: Floats
        band, self._states[layer] = lfilter(section[:3], section[3:], noise, zi=state)
        return band


def _cell(axis: list[float], at: float) -> tuple[int, float]:
    """The interval of a rising axis that holds a value, and how far into it the value is (0–1)."""
    at = min(max(at, axis[0]), axis[-1])
    i = min(bisect_right(axis, at) - 1, len(axis) - 2)
    return i, (at - axis[i]) / (axis[i + 1] - axis[i])
