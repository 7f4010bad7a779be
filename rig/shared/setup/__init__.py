"""The file in which one rig is described."""
