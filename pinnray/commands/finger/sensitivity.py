"""Derivatives of one finger's figures by its parameters."""

from math import isfinite
from pathlib import Path

from pinnray.commands.quiet import quietable
from pinnray.options.shared import FingerOptions, OutputPath, PhysicsOptions
from pinnray.runtime.errors import UserError


@quietable
def command(
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    figure: str = "force",
    wall_error: float = 0.1,
    young_error: float = 0.1,
    out: OutputPath = Path("out/sensitivity.csv"),
) -> int:
    """Say how a finger's figures change with each parameter, and within which interval prints lie.

    The derivatives are exact for the elements of fem, or of fem-nonlinear for a law of finite strain.

    Args:
        figure: Figure of the picture, such as force, wrap or von_mises.
        wall_error: Half of the 95 % interval of every wall's printed thickness, mm.
        young_error: Half of the 95 % interval of Young's modulus, over its value.
        out: CSV file of the derivatives; the picture is beside it.
    """
    from pinnray.designers import sensitivity
    from pinnray.runtime.tables import write_csv
    from pinnray.solvers.finger_figures import QUANTITIES
    from pinnray.solvers.registry import make_solver

    if figure not in QUANTITIES:
        raise UserError(f"--figure {figure}: there are {', '.join(QUANTITIES)}")
    for option, error in (("--wall-error", wall_error), ("--young-error", young_error)):
        if not 0 <= error < float("inf"):
            raise UserError(f"{option} {error:g}: give zero or more")
    if out.suffix != ".csv":
        raise UserError(f"--out {out}: the derivatives are a CSV file; give a name that ends in .csv")
    chosen, settings = finger.read()
    material, load = physics.read()
    finger.check_cost(chosen, settings, [make_solver("fem-nonlinear")])
    found = sensitivity(chosen, size=settings, material=material, load=load, progress=True)
    known = [name for name in found.derivatives if isfinite(getattr(found.figures, name))]
    if figure not in known:
        raise UserError(
            f"--figure {figure} is not known at the full load alone; there are {', '.join(known)}"
        )
    lines = list[tuple[str, str, str]]()
    for name in known:
        half = found.tolerance(name, wall_error=wall_error, young_error=young_error)
        shares = {each: share for each, share in found.relative(name).items() if abs(share) > 0}
        first = sorted(shares, key=lambda each: -abs(shares[each]))[:3]
        most = ", ".join(f"{each} {shares[each]:+.2g}" for each in first)
        value = f"{getattr(found.figures, name):.4g} ± {half:.2g} {QUANTITIES[name].unit}".rstrip()
        lines.append((name, value, most))
    widths = [max(len(line[column]) for line in lines) for column in (0, 1)]
    print(f"± for walls within {wall_error:g} mm and E within {young_error:.0%}; then percent per percent of")
    for name, value, most in lines:
        print(f"{name:<{widths[0]}}  {value:<{widths[1]}}  {most}".rstrip())
    write_csv(out, found.rows())
    print(out)
    print(found.plot(figure).save(out.with_suffix(".png")))
    return 0
