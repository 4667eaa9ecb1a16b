"""The tracker and the fit of discs, on films and pictures whose truth is known."""
