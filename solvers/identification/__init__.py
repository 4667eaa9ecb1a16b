"""The inverse problem at finite strain: contact, walls and law from the markers, for any discretised finger.

`search` varies the `unknowns` until a `model` of the finger, a `body` between the contact and the clamp of
`boundary`, predicts the markers; `cylinder_model` does so under a rigid cylinder. `result` ranks the laws and
what presses, and makes the solution with its `field`. `transfer` takes the finger to another load, and
`tracker` follows the force from frame to frame of a video.
Imports the problem and `solvers.assimilation`; no finite elements, no networks.
"""
