"""The rig file: what is assumed and what is measured of a rig."""
