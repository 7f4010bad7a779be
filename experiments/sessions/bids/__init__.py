"""What BIDS shows of it, and its validator."""
