"""Cost against accuracy of each method."""
