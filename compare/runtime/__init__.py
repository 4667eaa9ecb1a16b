"""How a command runs: processes, stages and progress, output folders, provenance, exit codes.

Imports nothing else of `compare`.
"""
