"""What senses a hand and what plays."""
