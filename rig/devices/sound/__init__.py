"""The process that plays, its supervision, what was played, limits of prepared signals."""
