"""What BIDS shows of the data that sessions wrote."""
