"""The default run: its tables on the pages."""
