"""The rig: what presents surfaces to a hand, its simulated twin, and the import of recordings."""
