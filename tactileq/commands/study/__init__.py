"""Commands about a study: its file, sessions, simulated people, power, thresholds; `schema`."""
