"""The cost of rendering on any machine, in counted operations and bytes.

Counts of `kernel.h`, one layer at a time (TQ_LANES 1); a C++ program that counts every operation of
the kernel itself confirms them (tests/modeling/rendering/counted_operations.cpp).
docs/method/rendering.md#counted-cost
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

# Of kernel.h: layers whose parameters are updated together, samples that are filtered in one go,
# numbers of a layer's state.
_SIDE_BY_SIDE, _CHUNK, _ROWS = 4, 64, 10
# Of these a sample reads and writes so many: of each layer, and of the noise branch.
_READ, _WRITTEN, _NOISE_BRANCH = 9, 3, 3


@dataclass(frozen=True)
class Operations:
    """Floating-point operations; comparisons and changes of sign are not counted."""

    additions: int  # and subtractions
    multiplications: int
    divisions: int
    square_roots: int

    @property
    def total(self) -> int:
        """All of them, each counted once."""
        return sum(astuple(self))


@dataclass(frozen=True)
class Cost:
    """What a stream costs, whatever the machine.

    `per_sample` is that of each sample, `per_update` what a parameter update adds while the hand is
    on the grid, nothing is clamped and no gain is at its slew; with an RMS limit every sample is
    taken to be limited. The noise adds integer operations, three multiplications of 64 bits a
    sample; a call or chunk of 64 samples adds three additions and a multiplication.

    `table_bytes` are all numbers of the texture, `state_bytes` the memory of a stream
    (`TQ_MEMORY`), each beside a structure of a few hundred bytes. `bytes_per_update` are read from
    the table; `bytes_per_sample` are read from and written to states, gains and coefficients.
    """

    per_sample: Operations
    per_update: Operations
    update_samples: int
    table_bytes: int
    state_bytes: int
    bytes_per_sample: int
    bytes_per_update: int

    @property
    def bytes(self) -> int:
        """Of table and state."""
        return self.table_bytes + self.state_bytes

    @property
    def operations(self) -> float:
        """Operations per sample, updates included."""
        return self.per_sample.total + self.per_update.total / self.update_samples

    @property
    def most_operations(self) -> int:
        """Operations of a sample with a parameter update."""
        return self.per_sample.total + self.per_update.total


def cost_of(
    *,
    layers: int,
    taps: int,
    update_samples: int,
    compensated: bool,
    rms_limited: bool,
    numbers: int,
    real_bytes: int,
) -> Cost:
    """The cost of a stream.

    Parameters
    ----------
    layers, taps, update_samples : int
        As in `tq_texture`.
    compensated, rms_limited : bool
        Whether there is a vibrator compensation, and a limit to the RMS.
    numbers : int
        Of the texture's arrays, all in all.
    real_bytes : int
        Of one number.
    """
    groups = -(-layers // _SIDE_BY_SIDE)
    lowpassed = taps > 1
    extrapolated = update_samples > 1
    per_sample = Operations(
        additions=6 + 9 * layers + 9 * compensated + 3 * rms_limited + (taps - 1) * lowpassed,
        multiplications=4 + 7 * layers + 7 * compensated + 5 * rms_limited + taps * lowpassed,
        divisions=int(rms_limited),
        square_roots=int(rms_limited),
    )
    per_update = Operations(
        additions=35 + 43 * layers + 8 * extrapolated,
        multiplications=30 + 73 * layers + 2 * groups + 2 * extrapolated,
        divisions=5 + 3 * layers + 4 * extrapolated,
        square_roots=layers,
    )
    return Cost(
        per_sample=per_sample,
        per_update=per_update,
        update_samples=update_samples,
        table_bytes=numbers * real_bytes,
        state_bytes=(_ROWS * layers + taps - 1 + _CHUNK) * real_bytes,
        bytes_per_sample=((_READ + _WRITTEN) * layers + _NOISE_BRANCH) * real_bytes,
        bytes_per_update=4 * (1 + 3 * layers) * real_bytes,
    )
