"""The cost of rendering on any machine, in counted operations and bytes.

Counts of `kernel.h`, one layer at a time (TQ_LANES 1); a C++ program that counts every operation of
the kernel itself confirms them (tests/modeling/rendering/counted_operations.cpp).
docs/method/rendering.md#counted-cost
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

from tactileq.modeling.rendering.interpolation import DOUBLING, PHASE

# Of kernel.h: layers whose parameters are updated together, samples that are filtered in one go,
# numbers of a layer's state.
_SIDE_BY_SIDE, _CHUNK, _ROWS = 4, 64, 10
# Of these a sample reads and writes so many: of each layer, and of the noise branch.
_READ, _WRITTEN, _NOISE_BRANCH = 9, 3, 3
# What interpolation keeps, with a chunk of the model's samples and the twice as many made of it.
_PAST, _DOUBLED = DOUBLING - 1 + _CHUNK, PHASE + 1 + 2 * _CHUNK


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

    `per_sample` is that of each sample at the model's rate, `per_output` that of each sample of the
    output, of which there are as many or more; `per_update` is what a parameter update adds while
    the hand is on the grid, nothing is clamped and no gain is at its slew. With an RMS limit every
    sample is taken to be limited. The noise adds integer operations, three multiplications of 64
    bits a sample; a call or chunk of 64 samples adds three additions, and
    where it is compensated a multiplication.

    `table_bytes` are all numbers of the texture, `state_bytes` the memory of a stream
    (`TQ_MEMORY`), each beside a structure of a few hundred bytes. `bytes_per_update` are read from
    the table; `bytes_per_sample`, at the model's rate, are read from and written to states, gains
    and coefficients.
    """

    per_sample: Operations
    per_update: Operations
    update_samples: int  # at the model's rate
    table_bytes: int
    state_bytes: int
    bytes_per_sample: int
    bytes_per_update: int
    per_output: Operations = Operations(0, 0, 0, 0)
    samples_per_output: float = 1.0

    @property
    def bytes(self) -> int:
        """Of table and state."""
        return self.table_bytes + self.state_bytes

    @property
    def operations(self) -> float:
        """Operations per sample of the output, updates included."""
        sample = self.per_sample.total + self.per_update.total / self.update_samples
        return self.per_output.total + sample * self.samples_per_output

    @property
    def most_operations(self) -> int:
        """Operations of a sample of the output with a parameter update."""
        return self.per_output.total + self.per_sample.total + self.per_update.total


def cost_of(
    *,
    layers: int,
    interpolated: bool,
    samples_per_output: float,
    update_samples: int,
    compensated: bool,
    rms_limited: bool,
    numbers: int,
    real_bytes: int,
) -> Cost:
    """The cost of a stream.

    Parameters
    ----------
    layers, update_samples : int
        As in `tq_texture`.
    interpolated : bool
        Whether the output has another rate than the model.
    samples_per_output : float
        At the model's rate for each sample of the output, at most 1.
    compensated, rms_limited : bool
        Whether there is a vibrator compensation, and a limit to the RMS.
    numbers : int
        Of the texture's arrays, all in all.
    real_bytes : int
        Of one number.
    """
    groups = -(-layers // _SIDE_BY_SIDE)
    extrapolated = update_samples > 1 or interpolated
    per_sample = Operations(
        additions=2 + 9 * layers + 2 * (DOUBLING - 1) * interpolated,
        multiplications=3 + 7 * layers + 2 * DOUBLING * interpolated,
        divisions=0,
        square_roots=0,
    )
    per_output = Operations(
        additions=4 + 9 * compensated + 3 * rms_limited + (PHASE - 1) * interpolated,
        multiplications=7 * compensated + 5 * rms_limited + PHASE * interpolated,
        divisions=int(rms_limited),
        square_roots=int(rms_limited),
    )
    per_update = Operations(
        additions=35 + 43 * layers + 8 * extrapolated,
        multiplications=30 + 73 * layers + 2 * groups + 2 * extrapolated,
        divisions=5 + 3 * layers + 2 * extrapolated,
        square_roots=layers,
    )
    return Cost(
        per_sample=per_sample,
        per_update=per_update,
        update_samples=update_samples,
        table_bytes=numbers * real_bytes,
        state_bytes=(_ROWS * layers + (_PAST + _DOUBLED) * interpolated) * real_bytes,
        bytes_per_sample=((_READ + _WRITTEN) * layers + _NOISE_BRANCH) * real_bytes,
        bytes_per_update=4 * (1 + 3 * layers) * real_bytes,
        per_output=per_output,
        samples_per_output=samples_per_output,
    )
