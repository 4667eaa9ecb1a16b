"""Young's modulus of a material, from a tensile test or a list of presets."""

from pathlib import Path

from pinnray.options.shared import OutputPath
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import say


def command(
    test: Path | None = None,
    *,
    poisson: float = 0.45,
    strain: float | None = None,
    out: OutputPath | None = None,
) -> int:
    """Fit the elastic laws to a tensile test, or list the materials that are known.

    The test is a table with a column of nominal strain (strain or strain_percent) and one of nominal stress
    (stress_MPa, stress_kPa or stress_Pa, or Engineering Stress (MPa)). Examples:

    - pinnray material
    - pinnray material strip.csv --poisson 0.49 --strain 0.3

    Args:
        test: The tensile test; default: list the presets.
        poisson: Poisson's ratio, which such a test does not show.
        strain: Largest strain that counts: that of the finger is 0.1 to 0.3. Default: all.
        out: PNG file of the curves; default: none.
    """
    from pinnray.runtime.tables import number, percent
    from pinnray.solvers.materials import MATERIALS, fitted, read_tensile_test

    if test is None:
        width = max(map(len, MATERIALS))
        for name, known in MATERIALS.items():
            young, ratio = number(known.material.young, 3), known.material.poisson
            spread = number(known.material.young_deviation, 2) if known.material.young_deviation else ""
            elastic = f"E = {young}{spread and f' ± {spread}'} MPa, ν = {ratio:g}"
            facts = f"{known.density:g} g/cm3, breaks at {known.strain_at_break:.0%}"
            loss = f", a cycle loses {known.material.loss:.0%}" if known.material.loss else ""
            print(f"{name:<{width}}  {elastic}, {facts}{loss}; {known.source}")
        return 0
    if not -1 < poisson < 0.5:
        raise UserError(f"--poisson {poisson:g}: give a ratio above -1 and below 0.5")
    if out is not None and out.suffix.lower() != ".png":
        raise UserError(f"--out {out}: give the name of a picture, such as material.png")
    measured = read_tensile_test(test)
    if strain is not None:
        measured = measured.up_to(strain)
    fits = fitted(measured, poisson=poisson)
    largest = float(measured.strain.max())
    print(f"{len(measured.strain)} points up to a strain of {percent(largest)}, ν = {poisson:g} given")
    for fit in fits:
        young, missed = number(fit.material.young, 4), percent(fit.misfit)
        print(f"{fit.material.law:<20} E = {young} MPa, misses the stress by {missed} (rms)")
    if fits[0].misfit > 0.05:
        say(f"warning: no law is near the test ({percent(fits[0].misfit)} off): take off preload or slack")
    for part in (0.05, 0.1, 0.25, 0.5, 1.0):
        if measured.strain.min() <= part <= largest:
            print(f"secant modulus at {part:.0%}: {number(measured.secant(part), 4)} MPa")
    chosen = {"": fits[0]}
    if fits[0].material.law == "linear":
        finite = [fit for fit in fits if fit.material.law != "linear"][:1]
        chosen = dict(zip(("small strain: ", "finite strain: "), [fits[0], *finite], strict=False))
    for strains, fit in chosen.items():
        young = f"{fit.material.young:.5g}±{fit.material.young_deviation:.2g}"
        print(f"{strains}--young {young} --poisson {poisson:g} --law {fit.material.law}")
    if out is not None:
        from pinnray.comparison.figures.tensile_test import draw_tensile_test

        draw_tensile_test(measured, fits).save(out)
        print(out)
    return 0
