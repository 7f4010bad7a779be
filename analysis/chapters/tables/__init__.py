"""Answers of any experiment, from a table."""
