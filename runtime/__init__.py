"""Processes, files, hashes, progress, output folders, tables and pages; serves all packages, knows none."""
