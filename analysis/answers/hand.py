"""Hand movement during the trials, read from the files that sessions store beside the answers.

docs/method/reliability.md#hand
"""

from __future__ import annotations

import gzip
import io
import json
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from tactileq.analysis.columns import MODEL, TEXTURE
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import Column, names
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.reading import read_bytes

HAND_MEASURES = ("speed_mm_s", "force_n", "contact_s", "presentations")
HAND_TABLE_COLUMNS = (
    Column("task", is_name=True),
    Column("participant_id", "participant", is_name=True),
    TEXTURE,
    MODEL,
    Column("trials"),
    Column("speed_mm_s", "speed while touching", "mm/s"),
    Column("force_n", "force while touching", "N"),
    Column("contact_s", "in contact, per trial", "s"),
    Column("presentations", "presentations per trial"),
)

_OF_READINGS = ("speed_mm_s", "force_n", "surface", "force_assumed", "trial")
_VIRTUAL = "a virtual surface"
_TRIAL = ["run", "trial"]
_ADVICE = "restore the file from a copy, or leave its session out"


def load_hand(data_folder: str | Path, answers: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """How the hand moved on virtual surfaces, per participant, texture and model.

    docs/method/reliability.md#hand

    Parameters
    ----------
    data_folder : str or Path
        Root of the data set: sub-*/ses-*/beh holds, beside the answers of a session,
        *_events.tsv and, for each start N of it, *_recording-startN_physio.tsv.gz with its sidecar.
    answers : mapping of task to DataFrame
        `Responses.answers`: participant_id, session, run, trial, texture, model. Only trials in
        them count, in the start of the session (`run`) in which they were answered: what was
        stored of a trial that broke off does not.

    Returns
    -------
    DataFrame
        `HAND_TABLE_COLUMNS`, a row per task whose trials have virtual surfaces of one model alone,
        participant, texture and model with means over its trials: of the speed (without its sign)
        and the measured force while touching a virtual surface, of the time in contact, and of the
        number of presentations of virtual surfaces. NaN where nothing measured it or the session
        stored none of it; no rows where no session stored any.

    Raises
    ------
    InputError
        For a file that cannot be read.
    """
    trials = []
    for task, table in answers.items():
        declared = ANSWER_TABLES[task]
        if table.empty or declared.both_models or not declared.of_surfaces:
            continue
        for _, own in table.groupby(["participant_id", "session"], sort=False):
            participant, session = own[["participant_id", "session"]].iloc[0]
            beh = Path(data_folder) / participant / session / "beh"
            of_session = _session_table(beh / f"{participant}_{session}_task-{task}", own)
            trials.append(of_session.assign(task=task))
    if not trials:
        return pd.DataFrame(columns=names(HAND_TABLE_COLUMNS))
    every = pd.concat(trials, ignore_index=True)
    if every[list(HAND_MEASURES)].isna().to_numpy().all():
        return pd.DataFrame(columns=names(HAND_TABLE_COLUMNS))
    cells = every.groupby(["task", "participant_id", "texture", "model"], sort=False)
    means = cells[list(HAND_MEASURES)].mean()
    return means.assign(trials=cells.size()).reset_index()[names(HAND_TABLE_COLUMNS)]


def _session_table(stem: Path, answers: pd.DataFrame) -> pd.DataFrame:
    """The answers of a session with what the hand did in each of them."""
    of_trial = answers[["participant_id", "texture", "model"]].reset_index(drop=True)
    keys = pd.MultiIndex.from_frame(answers[_TRIAL].astype(float))
    found = [_NOTHING]
    for run in sorted(set(keys.get_level_values("run"))):
        path = Path(f"{stem}_recording-start{run:.0f}_physio.tsv.gz")
        if path.is_file():
            found.append(_touched(path).assign(run=run))
    touched = pd.concat(found).set_index("run", append=True).swaplevel()
    measured = touched.reindex(keys).reset_index(drop=True)
    events = Path(f"{stem}_events.tsv")
    if events.is_file():
        presented = _presented(events).reindex(keys, fill_value=0).to_numpy(dtype=float)
    else:
        presented = np.full(len(keys), np.nan)
    return pd.concat([of_trial, measured], axis=1).assign(presentations=presented)


_NOTHING = pd.DataFrame(
    columns=["speed_mm_s", "force_n", "contact_s", "run"],
    index=pd.Index([], name="trial"),
    dtype=float,
)


def _touched(path: Path) -> pd.DataFrame:
    """Speed, force and time in contact with virtual surfaces of each trial of one start."""
    readings, rate_hz, virtual = _readings(path)
    readings = readings[(readings["surface"] == virtual) & readings["force_n"].notna()]
    # Readings off the surface have force 0.
    touching = readings[readings["force_n"] > 0]
    measured = touching["force_n"].where(touching["force_assumed"] == 0)
    return pd.DataFrame(
        {
            "speed_mm_s": touching["speed_mm_s"].abs().groupby(touching["trial"]).mean(),
            "force_n": measured.groupby(touching["trial"]).mean(),
            "contact_s": (readings["force_n"] > 0).groupby(readings["trial"]).sum() / rate_hz,
        }
    )


def _readings(path: Path) -> tuple[pd.DataFrame, float, float]:
    """The hand at regular times, their rate, and the number that stands for virtual surfaces."""
    sidecar_path = Path(str(path).removesuffix(".tsv.gz") + ".json")
    sidecar = read_json_object(sidecar_path, advice=_ADVICE)
    columns, rate_hz = sidecar.get("Columns"), sidecar.get("SamplingFrequency")
    if not isinstance(columns, list) or not set(_OF_READINGS) <= set(map(str, columns)):
        raise InputError(
            f"expected Columns with {', '.join(_OF_READINGS)} in {sidecar_path}, got "
            f"{shown(json.dumps(columns))}; {_ADVICE}."
        )
    if not isinstance(rate_hz, int | float) or not 0 < rate_hz < float("inf"):
        raise InputError(
            f"expected a SamplingFrequency above 0 in {sidecar_path}, got "
            f"{shown(json.dumps(rate_hz))}; {_ADVICE}."
        )
    surface = sidecar.get("surface")
    levels = surface.get("Levels") if isinstance(surface, Mapping) else None
    numbers = levels.items() if isinstance(levels, Mapping) else ()
    found = [number for number, level in numbers if level == _VIRTUAL]
    if len(found) != 1 or not found[0].isdecimal():
        raise InputError(
            f'expected one number for "{_VIRTUAL}" among the Levels of surface in {sidecar_path}, '
            f"got {len(found)}; {_ADVICE}."
        )
    readings = _table(path, _OF_READINGS, columns=columns)
    return readings, float(rate_hz), float(found[0])


def _presented(path: Path) -> pd.Series:
    """Number of presentations of virtual surfaces, by start of the session and trial."""
    events = _table(path, ("trial_type", "surface", *_TRIAL), numbers=_TRIAL)
    of_virtual = (events["trial_type"] == "presented") & (events["surface"] == "virtual")
    return events[of_virtual].groupby(_TRIAL).size()


def _table(
    path: Path,
    needed: Sequence[str],
    *,
    columns: Sequence[str] = (),
    numbers: Sequence[str] = _OF_READINGS,
) -> pd.DataFrame:
    """The columns that are needed of a table of BIDS; with `columns` compressed, without header."""
    data = read_bytes(path, "a table of a session")
    try:
        text = io.BytesIO(gzip.decompress(data) if columns else data)
        # The names are not given to pandas, which would take what is too much for an index.
        table = pd.read_csv(text, sep="\t", header=None if columns else 0, na_values="n/a")
        if columns and len(columns) != table.shape[1]:
            raise ValueError(f"{table.shape[1]} columns")
        table = table.set_axis(list(columns), axis=1) if columns else table
        return table[list(needed)].astype(dict.fromkeys(numbers, float))
    except (OSError, EOFError, zlib.error, ValueError, KeyError, OverflowError) as error:
        got = shown((str(error) or type(error).__name__).splitlines()[0])
        expected = f"a table with {len(columns)} columns" if columns else f"{', '.join(needed)}"
        raise InputError(f"expected {expected} in {path}, got {got}; {_ADVICE}.") from None
