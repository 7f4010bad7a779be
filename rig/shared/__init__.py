"""What all parts of a rig share: interface, rig file, clock and memory of processes, wire."""
