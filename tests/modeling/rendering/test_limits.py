"""What limits allow, against the limiter itself."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import Limits
from tactileq.modeling.rendering.plan import plan_for
from tactileq.modeling.rendering.reference.limiter import Limiter


@pytest.mark.parametrize("seconds", [0.02, 1.0])
@pytest.mark.parametrize("peak", [3.0, 1.1, 0.5, 50.0])
def test_what_a_running_rms_allows_on_end_is_reached_by_the_limiter(
    peak: float, seconds: float
) -> None:
    limits = Limits(peak=peak, rms=1.0, rms_window_s=1.0)
    plan = plan_for(5000.0, rate_hz=5000.0, limits=limits)
    felt = np.array(Limiter(plan).limit([100.0, -100.0] * round(2500 * seconds)))
    reached = np.sqrt(np.mean(felt**2))
    assert reached == pytest.approx(limits.largest_rms(seconds), rel=1e-3)
    if (peak, seconds) == (3.0, 1.0):  # the defaults of a rig file: docs/rig-file.md
        assert 20 * np.log10(reached) == pytest.approx(2.88, abs=0.01)


def test_what_a_running_rms_allows_without_a_peak_or_without_itself() -> None:
    assert Limits(rms=2.0).largest_rms(1.0) == pytest.approx(2 * np.sqrt(2))
    assert Limits(peak=2.0).largest_rms(1.0) == 2
    assert Limits().largest_rms(1.0) == np.inf
