"""Commands about a rig."""
