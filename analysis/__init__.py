"""Loading, statistics, tables, figures and the report."""
