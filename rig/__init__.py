"""What presents surfaces to a hand, and what records them."""
