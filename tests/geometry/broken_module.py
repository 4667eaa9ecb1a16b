"""A module that cannot be imported, as of a library with a fault."""

raise RuntimeError
