"""Emulators of a finger's field under loads that they have not seen: cost and error of each."""
