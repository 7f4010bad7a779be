"""What all parts of a rig share: `interface` is all that experiments see."""
