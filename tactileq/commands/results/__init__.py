"""Commands from answers to a report and its archive."""
