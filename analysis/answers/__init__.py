"""Loading of answers, each checked; the plan; answers to other programs' experiments."""
