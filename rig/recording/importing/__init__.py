"""Recordings of other equipment: WAV, CSV, phones, the Penn toolkit."""
