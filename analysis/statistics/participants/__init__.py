"""The hierarchical model of the participants."""
