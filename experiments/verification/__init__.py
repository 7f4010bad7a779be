"""Is everything as sessions stored it? seals, replay, copies."""
