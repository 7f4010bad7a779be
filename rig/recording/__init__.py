"""How recordings come about."""
