"""Loading, statistics, tables, figures and the report."""

from tactileq import modeling

if not hasattr(modeling, "HOMES"):  # modeling.py beside a script that is run
    raise ImportError(
        f"expected the package modeling of tactileq, got {modeling}; rename that, or run python -P."
    )
