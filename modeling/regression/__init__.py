"""Parameters on speed and force by least squares (eq. 3–4)."""
