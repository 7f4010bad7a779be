"""A device that renders by itself: its law in C99, models for it, what it plays in a rig.

docs/device.md
"""
