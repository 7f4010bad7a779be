"""Models for other programs: C headers, tables."""
