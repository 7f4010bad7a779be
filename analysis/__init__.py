"""From answers to a report; `columns` and `labels` are names that all share."""
