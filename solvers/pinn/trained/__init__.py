"""The paper's two networks with every weight trained by Gauss-Newton's method (preset `trained`).

`streams` evaluates the networks with their derivatives by position, and differentiates those by the weights;
`squares` writes energy and misfit as a sum of squares; `gauss_newton` minimises it; `solver` has the solvers.
"""
