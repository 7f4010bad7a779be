"""Recipe → WAV files and their manifest."""
