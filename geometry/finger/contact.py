"""The outline of a finger with its contact as pieces of its own."""

import numpy as np

from geometry.finger.finger import Finger
from geometry.section.loop import Loop
from geometry.section.section import Section

CONTACT = "contact"
"""Name of the contact's pieces."""

TOLERANCE = 1e-7
"""Largest distance of a corner from an end of the contact that it is, mm."""


def outline_with_contact(finger: Finger) -> Loop:
    """The outline with corners at the contact's ends and middle, and its pieces between them named so."""
    (low, high), loop = finger.contact_ends, finger.section.outline
    for x in (low, finger.contact_abscissa, high):
        which, fraction = Section(loop).front_place(x)
        if TOLERANCE < fraction * loop.lengths[which] < loop.lengths[which] - TOLERANCE:
            loop = loop.split(which, [fraction])
    for which in loop.pieces("front"):
        ends = np.sort(loop.ends[which, :, 0])
        if ends[0] > low - TOLERANCE and ends[1] < high + TOLERANCE:
            loop = loop.named(which, CONTACT)
    return loop
