"""Commands that record and import."""
