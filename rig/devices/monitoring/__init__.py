"""How well deadlines are kept, beside a bare process."""
