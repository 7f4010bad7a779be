"""Tables that other programs made: one reader, which reads what was meant or refuses."""
