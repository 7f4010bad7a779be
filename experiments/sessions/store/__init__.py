"""Where answers go: admission, the store, exposure, status, withdrawal."""
