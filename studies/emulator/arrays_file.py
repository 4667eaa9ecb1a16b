"""A file of named arrays that depend on something: safetensors, with texts in its header."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_bytes

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_bytes
from pinnray.runtime.errors import UserError


def keep_arrays(file: Path, arrays: Mapping[str, FloatArray], digest: str, **texts: str) -> None:
    """Write arrays atomically, with the digest of what they depend on and further texts."""
    whole = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    write_bytes(file, to_bytes(whole, metadata={"digest": digest, "arrays": _digest(whole), **texts}))


def kept_arrays(file: Path, digest: str) -> tuple[dict[str, FloatArray], dict[str, str]] | None:
    """The arrays of a file and its texts; None if there is none, or one of something else.

    Raises:
        UserError: If the file is damaged.
    """
    if not file.is_file():
        return None
    try:
        with safe_open(file, framework="numpy") as content:
            header: dict[str, str] = content.metadata() or {}
            if header["digest"] != digest:
                return None
            arrays = {name: content.get_tensor(name) for name in content.keys()}  # noqa: SIM118
        if header["arrays"] != _digest(arrays):
            raise ValueError("its numbers have changed")
        return arrays, header
    except (SafetensorError, KeyError, ValueError, OSError) as error:
        reason = " ".join(str(error).split())
        raise UserError(f"{file} is damaged ({reason}); let the emulator be fitted again (refit)") from None


def _digest(arrays: Mapping[str, FloatArray]) -> str:
    sha = hashlib.sha256()
    for name in sorted(arrays):
        sha.update(f"{name} {arrays[name].shape}".encode() + arrays[name].tobytes())
    return sha.hexdigest()
