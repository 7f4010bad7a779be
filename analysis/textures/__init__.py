"""Tables about models and recordings."""
