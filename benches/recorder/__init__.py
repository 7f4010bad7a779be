"""What the recorder held, and how near models of its records are to the truth."""
