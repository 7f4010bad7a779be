"""Power of a planned study."""
