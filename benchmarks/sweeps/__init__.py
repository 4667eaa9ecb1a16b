"""Speed of sweeps, and fronts against an optimiser without an emulator."""
