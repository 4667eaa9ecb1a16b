"""Commands that read a camera's images: calibrate, fiducials, track; and rig, which renders them."""
