"""Worlds of people for the model of the participants."""
