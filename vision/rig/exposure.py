"""Exposure of a picture: light, lens and sensor.

Noise of the sensor: the number of electrons of a pixel has a variance equal to its mean (EMVA Standard 1288,
release 4.0, section 2), here normally distributed, as it is above some ten electrons; the read noise has the
same variance everywhere. Units: pixels, grey levels of 0 to 255.
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.vision.frames.frame import Image

LUMA = (0.114, 0.587, 0.299)
"""Weights of blue, green and red (ITU-R BT.601)."""

GLARE = 0.04
"""Standard deviation of a lamp's reflection, over the width of the image."""

Light = NDArray[np.float32]
"""Light on the pixels, as shares of white, shape (height, width, 3)."""


class Exposure(CheckedModel):
    """Light, lens and sensor of the camera."""

    blur: float = bounded(0.8, 0, 20, "Standard deviation of the blur of the lens", "px")
    noise: float = bounded(1.0, 0, 100, "Standard deviation of the read noise", "grey levels")
    full_well: float | None = bounded(
        None, 100, 1e9, "Electrons at grey level 255; none: no photon noise", "electrons"
    )
    white: float = bounded(235.0, 10, 1000, "Grey level of white in the middle of the image", "grey levels")
    gradient: float = bounded(
        0.1, 0, 0.9, "Growth of the light from the middle of the image to its side, relative"
    )
    gradient_direction: float = bounded(
        30.0, -360, 360, "Direction in which the light grows, from right to down", "deg"
    )
    glare: float = bounded(
        0.0, 0, 1000, "Reflection of a lamp right of the middle, in its brightest pixel", "grey levels"
    )
    sharpen: float = bounded(0.0, 0, 10, "Unsharp mask: growth of differences from a blur of 1 px, relative")
    monochrome: bool = Field(default=False, description="A camera without colours")

    def lamp(self, size: tuple[int, int]) -> Light:
        """Illumination relative to that in the middle of the image, on a grid of so many columns and rows."""
        width, height = size
        angle = np.deg2rad(self.gradient_direction)
        x = (np.arange(width, dtype=np.float32) - (width - 1) / 2) * np.cos(angle)
        y = (np.arange(height, dtype=np.float32) - (height - 1) / 2) * np.sin(angle)
        return np.asarray(np.maximum(1 + self.gradient * (x + y[:, None]) / (width / 2), 0), np.float32)

    def develop(self, light: Light, rng: np.random.Generator) -> Image:
        """The image from light on the pixels, shape (height, width, 3), or (height, width) if monochrome."""
        grey = self.white * light
        if self.glare:
            grey += self.glare * self._reflection(light.shape[1::-1])[:, :, None]
        if self.monochrome:
            grey = grey @ np.array(LUMA, dtype=np.float32)
        if self.noise or self.full_well:
            variance = self.noise**2 + (grey * (255 / self.full_well) if self.full_well else 0.0)
            grey += np.sqrt(variance, dtype=np.float32) * rng.standard_normal(grey.shape, dtype=np.float32)
        if self.sharpen:
            import cv2  # the options of the rig are exposures, and `--help` has to be quick

            grey += self.sharpen * (grey - cv2.GaussianBlur(grey, (0, 0), 1.0))
        return np.asarray(np.clip(np.rint(grey), 0, 255), dtype=np.uint8)

    def _reflection(self, size: tuple[int, ...]) -> Light:
        """A lamp's reflection, 1 in its brightest pixel, shape (height, width)."""
        width, height = size
        x, y = (np.arange(width) - 0.6 * width) / GLARE, (np.arange(height) - 0.5 * height) / GLARE
        return np.asarray(np.exp(-(x**2 + y[:, None] ** 2) / (2 * width**2)), np.float32)
