"""What rivals cost, counted: `tests/benches/rendering/counted_rivals.cpp` counts those in C."""

from __future__ import annotations

import numpy as np

from tactileq.modeling.rendering.cost import Cost, Operations

# All costs are those of rendering at this rate, whatever the rate of the recordings.
COST_RATE_HZ = 5000.0
_CHUNK = 64  # samples that a stream keeps of its noise, as the kernel does
_SOUND_BYTES = 2
# Of readings at updates; the kernel takes in readings at times of their own, for 28 more.
_EXTRAPOLATING = Operations(14, 6, 2, 0)
_READING = Operations(12, 5, 2, 0)  # the place in the grid, and one value of it
_GAIN = Operations(12, 7, 2, 0)  # the same, and the level below the grid
_BLENDED = Operations(6, 6, 0, 0)  # another value
_NOISE = Operations(1, 2, 0, 0)  # a number of noise


def block_samples(block_s: float, rate_hz: float) -> int:
    """Length of a block: the power of two next to so many seconds."""
    return int(2 ** np.rint(np.log2(block_s * rate_hz)))


def grain_samples(grain_s: float, rate_hz: float) -> int:
    """Length of a grain, which is even."""
    return 2 * round(grain_s * rate_hz / 2)


def coefficients_cost(
    poles: int, zeros: int, *, nodes: int, update_samples: int, single: bool
) -> Cost:
    """A filter of p poles and q zeros by its coefficients, from a table of so many nodes.

    An update reads p + q + 1 numbers; as often as not every sample, the hand is extrapolated as by
    the kernel.
    """
    both, real_bytes = poles + zeros, 4 if single else 8
    return Cost(
        per_sample=_sum((1, Operations(both, both + 1, 0, 0)), (1, _NOISE)),
        per_update=_sum((1, _GAIN), (both, _BLENDED), (int(update_samples > 1), _EXTRAPOLATING)),
        update_samples=update_samples,
        table_bytes=nodes * (both + 1) * real_bytes,
        state_bytes=(2 * both + 1 + _CHUNK) * real_bytes,
        bytes_per_sample=(2 * both + 3) * real_bytes,
        bytes_per_update=4 * (both + 1) * real_bytes,
    )


def bands_cost(layers: int, *, nodes: int, update_samples: int, single: bool) -> Cost:
    """Bands in direct form I by their coefficients, from a table of so many nodes.

    Four bands share the difference of noise that they filter.
    """
    m, real_bytes = layers, 4 if single else 8
    return Cost(
        per_sample=_sum((1, Operations(-(-m // 4) + 3 * m, 1 + 3 * m, 0, 0)), (1, _NOISE)),
        per_update=_sum(
            (1, _GAIN),
            (3 * m, _BLENDED),
            (m, Operations(0, 1, 0, 0)),
            (int(update_samples > 1), _EXTRAPOLATING),
        ),
        update_samples=update_samples,
        table_bytes=nodes * (1 + 3 * m) * real_bytes,
        state_bytes=(5 * m + 3 + _CHUNK) * real_bytes,
        bytes_per_sample=(7 * m + 3) * real_bytes,
        bytes_per_update=4 * (1 + 3 * m) * real_bytes,
    )


def loops_cost(*, nodes: int, numbers: int, update_samples: int, single: bool) -> Cost:
    """Looped wavetables of 16 bits, four of them blended with weights that ramp."""
    real_bytes = 4 if single else 8
    update = Operations(13, 16, 3, 0)
    return Cost(
        per_sample=Operations(7, 4, 0, 0),
        per_update=_sum((1, update), (int(update_samples > 1), _EXTRAPOLATING)),
        update_samples=update_samples,
        table_bytes=numbers * _SOUND_BYTES + nodes * real_bytes,
        state_bytes=10 * real_bytes,
        bytes_per_sample=4 * _SOUND_BYTES,
        bytes_per_update=4 * real_bytes,
    )


def grains_cost(grain: int, *, nodes: int, numbers: int, single: bool) -> Cost:
    """Grains of recordings of 16 bits, two of four pieces each at a time."""
    real_bytes = 4 if single else 8
    update = Operations(10, 12, 2, 4)
    return Cost(
        per_sample=Operations(7, 10, 0, 0),
        per_update=_sum((1, update), (1, _EXTRAPOLATING)),
        update_samples=grain // 2,
        table_bytes=numbers * _SOUND_BYTES + (nodes + grain) * real_bytes,
        state_bytes=8 * real_bytes,
        bytes_per_sample=8 * _SOUND_BYTES + 2 * real_bytes,
        bytes_per_update=4 * real_bytes,
    )


def shaped_noise_cost(block: int, *, numbers: int, single: bool) -> Cost:
    """Noise shaped by a real inverse FFT of n = 2^k samples every n/2 of them.

    The FFT by split radix: n/2·(3·log2 n − 5) + 4 sums and n/2·(log2 n − 3) + 2 products (Sorensen,
    Jones, Heideman and Burrus 1987, "Real-valued fast Fourier transform algorithms"). Everything is
    due when a block begins.
    """
    n, real_bytes = block, 4 if single else 8
    power = round(np.log2(n))
    transform = Operations(n // 2 * (3 * power - 5) + 4, n // 2 * (power - 3) + 2, 0, 0)
    shaping = Operations(n // 2, 2 * n, 0, 0)  # magnitudes, window, overlap
    return Cost(
        per_sample=Operations(0, 0, 0, 0),
        per_update=_sum(
            (1, _READING),
            (n // 2, _BLENDED),
            (n, _NOISE),
            (1, transform),
            (1, shaping),
            (1, _EXTRAPOLATING),
        ),
        update_samples=n // 2,
        table_bytes=numbers * real_bytes,
        state_bytes=2 * n * real_bytes,
        bytes_per_sample=0,
        bytes_per_update=(4 * (n // 2 + 1) + 4 * n) * real_bytes,
    )


def _sum(*parts: tuple[int, Operations]) -> Operations:
    return Operations(
        *(
            sum(times * getattr(of, name) for times, of in parts)
            for name in ("additions", "multiplications", "divisions", "square_roots")
        )
    )
