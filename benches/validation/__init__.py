"""How often the statistics err."""
