"""The clock and the memory that processes share, messages between them, the audio callback in C."""
