"""Marker displacements from cameras, and the files they are kept in. Units: mm, pixels."""

import os

MOST_PIXELS = 200_000_000
"""Largest picture that OpenCV reads: a header alone may ask for gigabytes. It looks when it is loaded."""

os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MOST_PIXELS))
