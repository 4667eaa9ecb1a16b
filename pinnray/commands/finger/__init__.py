"""Commands about one finger: draw it, mesh it, solve it."""
