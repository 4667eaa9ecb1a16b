"""Runs of commands: processes, progress, output folders, provenance, HTML and terminal tables, exit codes.

Imports nothing else of `compare`.
"""
