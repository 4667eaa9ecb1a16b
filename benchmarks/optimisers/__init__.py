"""Optimisers that torch lacks, one a file, for the training recipes."""
