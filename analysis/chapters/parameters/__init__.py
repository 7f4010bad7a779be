"""Parameters on speed and force."""
