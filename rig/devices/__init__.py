"""What senses a hand and what plays, each in a process of its own; how well deadlines are kept."""
