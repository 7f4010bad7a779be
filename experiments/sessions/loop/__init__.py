"""One session as it runs: order, people, surfaces, the loop of its trials."""
