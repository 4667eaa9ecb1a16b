"""Reading of the options of `pinnray crossval`."""

from compare.commands.options import FingerOptions, SolverOptions, comma_list
from compare.crossval.folds import ALL, SCHEMES
from compare.crossval.study import ELEMENT_SIZE, SolverVariant, solver_variants
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.problem import Material


def read_finger(finger: FingerOptions, preset: str | None) -> tuple[Design, MeshSettings]:
    """The design and the mesh settings, coarser than usual unless the user chose a size or a preset."""
    design, mesh = finger.read(preset)
    if finger.mesh_size is None and preset is None:
        mesh = mesh.model_copy(update={"size": ELEMENT_SIZE})
    return design, mesh


def read_variants(options: SolverOptions, names: str, material: Material) -> list[SolverVariant]:
    """The solvers and their variants; a single one where --solver-set chooses the weight of the markers."""
    keys = [text.partition("=")[0].split(".") for text in options.solver_set]
    fixed = [key[0] for key in keys if key[1:] in (["choose"], ["weights"])]
    return solver_variants(options.read(names), material, fixed=fixed)


def read_schemes(text: str) -> list[str]:
    """Names of schemes with commas between them."""
    held = [scheme for scheme in SCHEMES if scheme != ALL]
    names = comma_list(text)
    if unknown := next((name for name in names if name not in held), None):
        raise UserError(f"--schemes: there is no scheme {unknown!r}; there are {', '.join(held)}")
    if not names or len(set(names)) < len(names):
        raise UserError(f"--schemes {text}: name at least one of {', '.join(held)}, none twice")
    return names
