"""From answers to a table of thresholds that `tactileq simplify --threshold` reads.

docs/method/protocols.md#detection-threshold
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np

from tactileq.experiments.tasks.threshold import DURATION_S
from tactileq.experiments.tasks.threshold_posterior import Estimate, answers_of, estimate
from tactileq.modeling import InputError
from tactileq.modeling.errors import counted
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import Column, chosen
from tactileq.modeling.files.tables import Row, read_table, table_text
from tactileq.modeling.perception.thresholds import THRESHOLD_COLUMNS

READ = chosen(
    ANSWER_TABLES["threshold"].columns,
    *("phase", "frequency_hz", "amplitude_g", "highest_g", "correct", "valid"),
    *("pilot", "simulated"),
)
THRESHOLD_TABLE_COLUMNS = (
    *chosen(THRESHOLD_COLUMNS, "frequency_hz", "acceleration_g"),
    Column("low_g", unit="g", description="Lower end of its 95 % interval; n/a of a bound"),
    Column("high_g", unit="g", description="Upper end of its 95 % interval; n/a of a bound"),
    Column("level_db", unit="dB re 1 g", description="The threshold as a level, mean over people"),
    Column(
        "sd_db",
        unit="dB",
        description="Standard deviation between people; of one person, of the posterior",
    ),
    Column("slope", description="Slope of the psychometric function (Weibull's), mean"),
    Column("lapse_rate", description="Share of answers that do not depend on amplitude, mean"),
    Column("trials", description="Number of answers"),
    Column("people", description="Number of participants"),
    Column(
        "note",
        description="Where the threshold is only a bound, or somebody lapsed too often; else n/a",
    ),
)
BEYOND = {
    "above": "above the highest amplitude: a lower bound",
    "below": "below the lowest amplitude: an upper bound",
}
MORE_LAPSES = "more lapses than assumed: probably too high"


@dataclass(frozen=True, kw_only=True)
class ThresholdAnswers:
    """What some people answered.

    Parameters
    ----------
    files : tuple of Path
        Where it was read.
    estimates : mapping of participant to their thresholds
        Of each frequency with an answer.
    """

    files: tuple[Path, ...]
    estimates: Mapping[str, Mapping[float, Estimate]]
    simulated: bool


@dataclass(frozen=True, kw_only=True)
class MeanThreshold:
    """The threshold at one frequency over people.

    Parameters
    ----------
    frequency_hz, level_db : float
        The mean of the people's levels (dB re 1 g, peak).
    sd_db : float
        Of one person the posterior standard deviation, else that between people.
    interval_db : (float, float) or None
        95 %: of one person mean ± 1.96 SD, else Student's; None where a threshold is only a bound.
    slope, lapse_rate : float
        Means.
    note : str
        Where somebody's threshold lay beyond what was presented, or somebody lapsed too often.
    """

    frequency_hz: float
    level_db: float
    sd_db: float
    interval_db: tuple[float, float] | None
    slope: float
    lapse_rate: float
    trials: int
    people: int
    note: str


# --- Read -----------------------------------------------------------------------------------


def read_answers(data_folder: str | Path, *, subject: int | None = None) -> ThresholdAnswers:
    """The answers of one participant, or of all, with the thresholds that follow from them.

    Parameters
    ----------
    subject : int, optional
        Everybody without it. Pilots are left out.

    Raises
    ------
    InputError
        If nobody has answered, a table is damaged, or simulated and real people are mixed.
    """
    folder = Path(data_folder)
    files = answer_files(folder, subject=subject)
    rows: dict[str, list[Row]] = {}
    simulated = set()
    for file in files:
        for row in read_table(file, READ, bids=True):
            if row["pilot"] != "true":
                rows.setdefault(file.parts[-4], []).append(row)
                simulated.add(row["simulated"])
    if len(simulated) > 1:
        raise InputError(
            f"expected answers of people or of simulated ones in {folder}, got both; keep them in "
            "different folders, or name one with --subject."
        )
    estimates = {person: _estimates(own) for person, own in rows.items()}
    estimates = {person: own for person, own in estimates.items() if own}
    if not estimates:
        whose = "" if subject is None else f" of participant {subject}"
        raise InputError(
            f"expected answers{whose} to main trials of the threshold task in {folder}, got none; "
            "run tactileq session --task threshold first (pilots do not count)."
        )
    return ThresholdAnswers(files=files, estimates=estimates, simulated=simulated == {"true"})


def answer_files(data_folder: str | Path, *, subject: int | None = None) -> tuple[Path, ...]:
    """The tables with the answers of one participant, or of all."""
    who = "*" if subject is None else f"{subject:02d}"
    found = Path(data_folder).glob(f"sub-{who}/ses-*/beh/sub-*_task-threshold_beh.tsv")
    return tuple(sorted(found))


def _estimates(rows: Sequence[Mapping[str, object]]) -> dict[float, Estimate]:
    answers = answers_of(rows)
    return {
        frequency_hz: estimate(answers, frequency_hz)
        for frequency_hz in sorted({a.frequency_hz for a in answers})
    }


# --- Over people ----------------------------------------------------------------------------


def mean_thresholds(estimates: Mapping[str, Mapping[float, Estimate]]) -> list[MeanThreshold]:
    """The mean level (dB) over people at each frequency, rising, with its 95 % interval.

    Raises
    ------
    InputError
        For fewer than two frequencies, which make no table.
    """
    frequencies_hz = sorted({frequency for own in estimates.values() for frequency in own})
    if len(frequencies_hz) < 2:
        raise InputError(
            "expected answers at two frequencies or more for a table of thresholds, got "
            f"{len(frequencies_hz)}; finish the session."
        )
    return [
        _mean([own[frequency] for own in estimates.values() if frequency in own])
        for frequency in frequencies_hz
    ]


def _mean(of: Sequence[Estimate]) -> MeanThreshold:
    levels_db = np.array([one.level_db for one in of])
    count = len(of)
    sd_db = of[0].sd_db if count == 1 else float(levels_db.std(ddof=1))
    beyond = [BEYOND[one.beyond] for one in of if one.beyond]
    noted = [*beyond, *(MORE_LAPSES for one in of if one.more_lapses)]
    notes = [f"{noted.count(sentence)} of {count} {sentence}" for sentence in dict.fromkeys(noted)]
    half_db = _factor(count) * sd_db
    mean_db = float(levels_db.mean())
    return MeanThreshold(
        frequency_hz=of[0].frequency_hz,
        level_db=mean_db,
        sd_db=sd_db,
        interval_db=None if beyond else (mean_db - half_db, mean_db + half_db),
        slope=float(np.mean([one.slope for one in of])),
        lapse_rate=float(np.mean([one.lapse_rate for one in of])),
        trials=sum(one.trials for one in of),
        people=count,
        note="; ".join(notes) if count > 1 else "".join(noted),
    )


def _factor(count: int) -> float:
    """Half the 95 % interval of a mean over this many people, in standard deviations."""
    from scipy.stats import norm, t  # late: takes longer to load than all of modeling

    if count == 1:
        return float(norm.ppf(0.975))
    return float(t.ppf(0.975, count - 1)) / sqrt(count)


# --- Write ----------------------------------------------------------------------------------


def threshold_text(means: Sequence[MeanThreshold], *, people: int, simulated: bool) -> str:
    """The table as a TSV with its source and caveat; `Threshold.load` reads it."""
    who = f"{counted(people, 'person', 'people')}{' (simulated)' if simulated else ''}"
    bounds = [f"{one.frequency_hz:g} Hz" for one in means if one.interval_db is None]
    caveat = "measured with a pen held still; a stroking hand is less sensitive"
    if bounds:
        caveat += f"; at {', '.join(bounds)} only a bound (see note)"
    if any(MORE_LAPSES in one.note for one in means):
        caveat += "; strong tones were missed more often than the estimate assumes (see note)"
    notes = (
        f"# source: tactileq threshold, {who}: two-interval forced choice (QUEST+) of bursts of "
        f"{DURATION_S:g} s, 75 % correct, lapses excluded\n# caveat: {caveat}\n"
    )
    return notes + table_text(THRESHOLD_TABLE_COLUMNS, [_cells(one) for one in means])


def _cells(one: MeanThreshold) -> dict[str, object]:
    low_g, high_g = (None, None) if one.interval_db is None else map(_g, one.interval_db)
    return {
        "frequency_hz": f"{one.frequency_hz:g}",
        "acceleration_g": _g(one.level_db),
        "low_g": low_g,
        "high_g": high_g,
        "level_db": f"{one.level_db:.2f}",
        "sd_db": f"{one.sd_db:.2f}",
        "slope": f"{one.slope:.2f}",
        "lapse_rate": f"{one.lapse_rate:.3f}",
        "trials": one.trials,
        "people": one.people,
        "note": one.note or None,
    }


def _g(level_db: float) -> str:
    return f"{10 ** (level_db / 20):.6g}"
