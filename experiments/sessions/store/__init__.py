"""Where a session's answers go: admission, store, exposure, status, withdrawal."""
