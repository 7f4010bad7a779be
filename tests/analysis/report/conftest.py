"""Reports with fewer draws: what is drawn is tested with the statistic, here how it is told."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module", autouse=True)
def few_draws() -> Iterator[None]:
    """No test of a report hangs on p values of more than a thousand draws."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("analysis.statistics.similarity_choice.SIMULATIONS", 19)
        patch.setattr("analysis.statistics.paired.RESAMPLES", 999)
        patch.setattr("analysis.statistics.rates.BOOTSTRAP_RESAMPLES", 500)
        yield
