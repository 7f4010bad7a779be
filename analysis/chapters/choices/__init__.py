"""Right answers against chance."""
