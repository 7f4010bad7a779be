"""One texture's models against its recordings: full, simplified and driven by regressions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from tactileq.analysis.page.sections import Mapped
from tactileq.analysis.textures.likeness import condition_targets, gfc_table
from tactileq.analysis.textures.regressions import driven_table
from tactileq.analysis.textures.results import TextureResult


@dataclass(frozen=True, eq=False)
class Comparison:
    """What `gfc_table` and `driven_table` say of one texture, against the same draws."""

    gfc: pd.DataFrame
    driven: pd.DataFrame


def comparisons(
    results: Sequence[TextureResult],
    streams: Sequence[np.random.Generator],
    *,
    mapped: Mapped = map,
) -> Iterable[Comparison]:
    """The comparison of each texture, in order.

    Parameters
    ----------
    streams : sequence of Generator
        Of the draws behind the expected GFCs: each texture has one of its own, so that its
        numbers do not depend on how the work is divided.
    mapped : callable
        How the textures are gone through.
    """
    return mapped(_comparison, list(zip(results, streams, strict=True)))


def _comparison(texture: tuple[TextureResult, np.random.Generator]) -> Comparison:
    result, rng = texture
    full = result.model
    targets = condition_targets(result.recordings, rate_hz=full.rate_hz, rng=rng)
    return Comparison(
        gfc_table(targets, full, result.simplification.model), driven_table(full, targets)
    )
