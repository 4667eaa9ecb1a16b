"""What assimilating solvers share: misfit to the markers, marker forces, marker weight, parameter estimation.

Imports the problem, the solution and the solver interface; no finite elements, no networks.
"""
