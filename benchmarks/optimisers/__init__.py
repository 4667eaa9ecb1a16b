"""Optimisers that serve generally, one a file; Adam and L-BFGS are torch's."""
