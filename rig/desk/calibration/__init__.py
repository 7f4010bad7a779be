"""Level, latency, resonance and noise floor of a rig; pose and stiffness of a force device."""
