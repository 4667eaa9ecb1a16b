"""Options that several commands share, from the command line or from a TOML file."""
