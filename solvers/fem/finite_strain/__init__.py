"""`fem-nonlinear`: the load path and Newton's method; imports the shared modules of `solvers.fem`."""
