"""One session and the folder of all."""
