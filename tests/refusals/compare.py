"""Names of the refused expressions of `compare`."""
