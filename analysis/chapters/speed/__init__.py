"""Response times beside right answers."""
