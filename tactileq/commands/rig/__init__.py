"""Commands about a rig, and `feel`."""
