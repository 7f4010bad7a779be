"""How the hand moved."""
