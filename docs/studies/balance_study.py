"""How balanced the orders of the paper's study are, over 200 seeds.

Run as `python docs/studies/balance_study.py`; writes balance_study.tsv beside it.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from pathlib import Path

from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks.balance import balance_of

SEEDS = range(200)


def main() -> None:
    """Least and most of every count over all seeds."""
    shipped = Study.load()
    found = defaultdict(list)
    for seed in SEEDS:
        study = replace(shipped, seed=seed)
        for row in (row for task in study.tasks for row in balance_of(study, task)):
            found[row.task, row.what, row.of] += [row.least, row.most]
    lines = ["task\tcounted\tof\tleast\tmost"]
    for (task, what, of), counts in found.items():
        lines.append(f"{task}\t{what}\t{of}\t{min(counts)}\t{max(counts)}")
    Path(__file__).with_suffix(".tsv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
