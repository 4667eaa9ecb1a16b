"""Provenance of a result: versions and machine."""

import os
import platform
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version

PACKAGES = (
    *("pinn-ray", "numpy", "scipy", "scikit-learn", "torch", "fenics-dolfinx", "fenics-ufl", "petsc4py"),
    *("mpi4py", "gmsh", "cadquery", "pyvista", "vtk", "opencv-python-headless"),
)


def package_versions() -> dict[str, str]:
    """Versions of all packages that affect the numbers or pictures."""
    return {"python": platform.python_version()} | {package: _version(package) for package in PACKAGES}


def program_version() -> str:
    """Version of pinn-ray, as it is installed."""
    return _version("pinn-ray")


def _version(package: str) -> str:
    """Version of a package; that of its module where it is not installed by pip."""
    try:
        return _installed_version(package)
    except PackageNotFoundError:
        module = sys.modules.get({"fenics-dolfinx": "dolfinx", "fenics-ufl": "ufl"}.get(package, package))
        return str(getattr(module, "__version__", "unknown"))


_installed_version = cache(version)


def machine() -> dict[str, str | int]:
    """The operating system, the processor and its cores."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": cores()}


def cores() -> int:
    """Number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
