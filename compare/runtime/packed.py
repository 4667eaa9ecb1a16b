"""Numbers within a page: arrays in one piece, compressed, which `packed.js` reads."""

import base64
import gzip
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry.arrays import FloatArray


class Packed:
    """Arrays in one piece of memory; `add` gives the place and type by which the browser reads one."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._length = 0

    def add(self, values: NDArray[Any]) -> dict[str, Any]:
        """Append an array of float64, float32, uint32, uint16 or uint8."""
        data = values.tobytes()
        place = {"kind": str(values.dtype), "offset": self._length, "length": values.size}
        data += bytes(-len(data) % 8)
        self._pieces.append(data)
        self._length += len(data)
        return place

    def add_steps(self, values: FloatArray, least: float = 0.0) -> dict[str, Any]:
        """Append values as steps of their range, or of `least` if that is more: low + step * number.

        All low bytes of the numbers come before all high ones, which compresses better.
        """
        low, high = float(values.min()), float(values.max())
        step = max((high - low) / 65_535, least) or 1.0
        steps = np.round((values.ravel() - low) / step).astype("<u2")
        return self.add(steps.view(np.uint8).reshape(-1, 2).T) | {"low": low, "step": step}

    def text(self) -> str:
        """All of it, compressed, in Base64."""
        return base64_text(b"".join(self._pieces))


def base64_text(data: bytes) -> str:
    """Data compressed by gzip, in Base64."""
    return base64.b64encode(gzip.compress(data, compresslevel=6, mtime=0)).decode("ascii")
