"""Commands that read a camera's images: calibrate, pick, fiducials, track; and rig, which renders them."""
