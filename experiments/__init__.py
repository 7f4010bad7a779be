"""Experiments: designs and orders, protocols, store, console and simulated participants."""
