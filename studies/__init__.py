"""Many problems: sweeps over designs, an emulator of them, the best design, a grid of a solver's settings."""
