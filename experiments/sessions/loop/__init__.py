"""A session as it runs: order, task, people, surfaces, the loop of its trials."""
