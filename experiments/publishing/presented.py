"""What was presented in a trial, rendered again from what is stored.

docs/method/publishing.md#rendered-again
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tactileq.experiments.sessions.kept.files import sessions_in
from tactileq.experiments.sessions.kept.stored_sessions import held_session
from tactileq.experiments.sessions.kept.trace_rows import hand_rows, presentation_rows
from tactileq.experiments.sessions.kept.traces import HAND_COLUMNS
from tactileq.modeling import InputError, Renderer
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import shown
from tactileq.modeling.files.columns import names
from tactileq.modeling.models.loading import AnyModel

FEWEST_READINGS = 2


def render_presentation(
    data_folder: str | Path,
    session: str,
    presentation: int,
    *,
    models: Iterable[AnyModel],
    run: int = 1,
) -> Floats:
    """The vibration of a virtual surface under the hand that stroked it: the same bits each time.

    The noise is that of the presentation's number with seed 0, as rigs draw it; speed and force
    are interpolated linearly between the stored readings.

    Parameters
    ----------
    session : str
        As sub-01_ses-01_task-absolute.
    presentation : int
        Its number in `presentations.tsv`.
    models : iterable of models
        Among which the one that was presented is found by its SHA-256.
    run : int
        Which start of the session.

    Returns
    -------
    (n,) array
        In g, at the model's rate.

    Raises
    ------
    InputError
        If there is no such session or presentation, nothing virtual was presented, its model is not
        among these, or fewer than two readings of the hand were stored.
    """
    files = next((one for one in sessions_in(data_folder) if one.stem == session), None)
    if files is None:
        raise InputError(f"expected a session of {data_folder}, got {shown(session)}; name one.")
    held_session(files)  # refuses one that is damaged
    rows, _ = presentation_rows(files.named("presentations.tsv"), runs={run})
    row = next((row for row in rows if row["presentation"] == str(presentation)), None)
    if row is None or row["surface"] != "virtual":
        got = "none" if row is None else f"a {row['surface']} one"
        raise InputError(
            f"expected a virtual surface as presentation {presentation} of start {run} of "
            f"{session}, got {got}; choose another one of its presentations.tsv."
        )
    model = next((one for one in models if one.sha256 == row["model_sha256"]), None)
    if model is None:
        raise InputError(
            f"expected the model {row['model_sha256'][:8]} that was presented, got others; load "
            "the set of models that the session presented."
        )
    header = names(HAND_COLUMNS)
    at = [header.index(n) for n in ("presentation", "time_s", "speed_mm_s", "force_n")]
    readings = hand_rows(files.named("hand.tsv"), runs={run}).rows
    cells = (reading.decode("utf-8").split("\t") for reading in readings)
    picked = [[line[i] for i in at] for line in cells if line[at[0]] == str(presentation)]
    known = [line[1:] for line in picked if "n/a" not in line]
    if len(known) < FEWEST_READINGS:
        raise InputError(
            f"expected readings of the hand during presentation {presentation} of {session}, got "
            f"{len(known)}; choose one that was stroked."
        )
    time_s, speed_mm_s, force_n = np.array(known, dtype=np.float64).T
    renderer = Renderer(model, seed=0, stream=presentation)
    count = int((time_s[-1] - time_s[0]) * renderer.rate_hz) + 1
    moments = time_s[0] + np.arange(count) / renderer.rate_hz
    speed, force = (np.interp(moments, time_s, values) for values in (speed_mm_s, force_n))
    return renderer.render(speed, force)
