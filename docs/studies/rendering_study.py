"""How exact rendering is: excess variance, late updates, clicks; other rates, crests of the noise.

Simulated: moving parameters, strokes and steps of the hand are made up, the textures planted.

Example: python docs/studies/rendering_study.py writes rendering_study_stability.tsv and .png,
rendering_study_accuracy.tsv, _readings.tsv, _turning.tsv, rendering_study_clicks.tsv and .png,
rendering_study_other_rates.tsv and _crests.tsv beside this file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from analysis.benches.accuracy import accuracy_row, reading_rows, turning_rows
from analysis.benches.clicks import (
    STEPS,
    THIS_RENDERER,
    click_table,
    level_above_click_hz,
    step_signals,
)
from analysis.benches.crests import crest_table
from analysis.benches.other_rates import RATES_HZ, rate_row
from analysis.benches.stability import (
    FORMS,
    RATE_HZ,
    excess_db,
    held_variances,
    motions,
    moving_variances,
    stability_table,
)
from analysis.figures.stability import figure_clicks, figure_stability
from stimuli.planted.textures import TEXTURES, planted_texture

MOTION = "30 % jitter"
SHOWN_SAMPLES = 200
# Gains switched make the same step in every form, so one of them is drawn.
SWITCHED = [f"{form}, switched" for form in FORMS]
SHOWN = {
    "pressed, 0 → 2 N": [SWITCHED[0], THIS_RENDERER],
    "lifted, 2 → 0 N": [SWITCHED[0], THIS_RENDERER],
    "faster, 100 → 200 mm/s": [THIS_RENDERER, *SWITCHED[1:]],
}


def stability(target: Path) -> pd.DataFrame:
    """The table and the figure of excess variance."""
    moved = motions(np.random.default_rng(0))
    table = stability_table(moved)
    courses = {}
    for name, form in FORMS.items():
        held = held_variances(moved[MOTION], form, rate_hz=RATE_HZ)
        excess = excess_db(moving_variances(moved[MOTION], form, rate_hz=RATE_HZ), held)
        courses[name] = excess.bands[:SHOWN_SAMPLES, 1]
    title = f"{MOTION}: the band at 300 Hz, 40 Hz wide"
    figure = figure_stability(table, courses, motion=title, rate_hz=RATE_HZ)
    figure.savefig(target.with_name(f"{target.name}_stability.png"), dpi=110)
    return table


def clicks(target: Path) -> pd.DataFrame:
    """The table and the figure of steps."""
    steps = [step_signals(step) for step in STEPS]
    figure = figure_clicks([(s, level_above_click_hz(s)) for s in steps], shown=SHOWN)
    figure.savefig(target.with_name(f"{target.name}_clicks.png"), dpi=110)
    return pd.concat([click_table(signals) for signals in steps], ignore_index=True)


def other_rates() -> pd.DataFrame:
    """The table of levels at other rates than the model's."""
    models = [planted_texture(name) for name in TEXTURES]
    return pd.DataFrame([rate_row(m, rate_hz=rate_hz) for rate_hz in RATES_HZ for m in models])


def main() -> None:
    """Run the study and write its tables and figures beside this file."""
    target = Path(__file__).with_suffix("")
    tables = {
        "stability": stability(target),
        "accuracy": pd.DataFrame([accuracy_row(planted_texture(name)) for name in TEXTURES]),
        "readings": pd.DataFrame(reading_rows(planted_texture("canvas"))),
        "turning": pd.DataFrame(turning_rows(planted_texture("canvas"))),
        "clicks": clicks(target),
        "other_rates": other_rates(),
        "crests": crest_table(),
    }
    for name, table in tables.items():
        path = target.with_name(f"{target.name}_{name}.tsv")
        table.to_csv(path, sep="\t", index=False, float_format="%.4g", na_rep="n/a")
        print(table.to_string(index=False, float_format="%.4g"), end="\n\n")


if __name__ == "__main__":
    main()
