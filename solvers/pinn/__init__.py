"""Physics-informed neural networks that minimise the potential energy, in PyTorch."""
