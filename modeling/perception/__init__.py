"""Thresholds, the power that dropping layers changes, simplification and its verdicts."""
