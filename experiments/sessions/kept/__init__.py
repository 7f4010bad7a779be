"""What a session keeps on disk and how it is read again: manifest, log, traces, roster."""
