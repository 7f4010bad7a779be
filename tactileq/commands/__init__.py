"""One file for each command, and what commands of a group alone use."""
