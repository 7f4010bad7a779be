"""Tasks that are only counted."""
