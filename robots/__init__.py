"""Models of a finger for robot simulators, and their score against `fem-nonlinear`.

`presses` solves the loads to fit and to score, `chain` and `springs` fit hinges, `solid_mesh` extrudes the
section, `mjcf` and `solid_files` write the models, `simulation` and `score` judge those for MuJoCo.

Files are in m, kg, s, N and Pa. The finite elements are of plane strain: a force is N/mm times the depth.
"""
