"""The inverse problem at finite strain: contact, walls and law from the markers, for any discretised finger.

Imports the problem and `solvers.assimilation`; no finite elements, no networks.
"""
