"""The virtual rig: what a camera would have seen of a finger, with known truth. Units: mm, pixels."""
