"""The rig, which presents surfaces to a hand, its simulated twin, and the import of recordings."""
