"""Checks units, and measured marker displacements against finger, indenter's stroke and `fem`.

What is impossible is refused, what is unlikely warned of, with what was read and what was expected.
"""

import numpy as np

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import OutsideBodyError, UserError
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import MissingLibraryError, make_solver
from pinnray.solvers.solver import NONE_SEEN
from pinnray.vision.measurements import SMALLEST_DISTANCE
from pinnray.vision.point_order import SURE, likeliest_order, likelihoods, order_text

LOOKS_LIKE = "this looks like"
"""Words before the unit that a number is taken to have."""
CONVENTION = "u and v are final minus initial position, in mm, u towards the tip and v out of the front"
UNLIKE = 0.5
"""Cosine between measured and linear displacements of all markers below which they are unlike. At finite
strain it is 0.85 or more on 21 fingers and loads with strokes up to 22 mm."""
SIZES = 3.0
"""Ratio of measured to linear displacements that is unlikely; at finite strain it is 0.86 to 1."""
IMPOSSIBLE = 200.0
"""Ratio that no other stroke explains: no camera sees one so much smaller, no finger bears a larger one."""
SMALL = 0.1
"""Share of the stroke below which `fem`'s displacements at the markers say little of a direction."""


def check_positions(observations: Observations, mesh: TriangleMesh) -> None:
    """Raise a `UserError` if no marker was seen, or they cannot be markers of the body.

    They cannot if one is not on the body, or two are at one place.
    """
    points = observations.points
    if not observations.known:
        raise UserError(NONE_SEEN)
    try:
        mesh.locate(points)
    except OutsideBodyError as error:
        raise UserError(
            f"the measurements are not of this finger: {error}; positions are those before loading, in the "
            "finger's frame, in mm, x from base to tip and y < 0 below the front face"
        ) from None
    apart = np.linalg.norm(points[:, None] - points, axis=2)[np.triu_indices(len(points), 1)]
    if len(apart) and float(apart.min()) < SMALLEST_DISTANCE:
        first, second = (int(ends[apart.argmin()]) + 1 for ends in np.triu_indices(len(points), 1))
        raise UserError(f"the markers {first} and {second} are at one place; keep one")


def problem_remarks(problem: Problem) -> list[str]:
    """Remarks on a load or a material that looks like another unit, a line each."""
    load, young, length = problem.load, problem.material.young, _length(problem)
    remarks = [
        f"the {name} of {size:g} mm is {size / length:.1g} of the finger's length; {LOOKS_LIKE} metres, "
        "give mm"
        for name, size in (("stroke", float(np.abs(load.values).max())), ("radius", load.radius))
        if size is not None and 0 < size < 1e-3 * length  # usual strokes have per cents
    ]
    if not 0.02 <= young <= 2e4:  # the softest silicones have 0.05, filled plastics up to 15,000
        unit = "gigapascals" if young < 0.02 else "pascals"
        remarks.append(
            f"Young's modulus of {young:g} MPa is no rubber's or plastic's; {LOOKS_LIKE} {unit}, give MPa"
        )
    return remarks


def displacement_remarks(observations: Observations, problem: Problem) -> list[str]:
    """Remarks on unlikely displacements of the markers, a line each.

    Args:
        observations: The markers, all on the body.
        problem: The finger and its load, which `fem` solves for comparison.

    Raises:
        UserError: If the displacements are impossible.
    """
    seen = observations.visible
    points, moved = observations.points[seen], observations.displacements[seen]
    length = _length(problem)
    farthest = int(np.linalg.norm(moved, axis=1).argmax())
    far, number = float(np.linalg.norm(moved[farthest])), int(np.flatnonzero(seen)[farthest]) + 1
    if far > 2 * length:
        raise UserError(
            f"the measurements are impossible: marker {number} moved by {far:.4g} mm, and the finger is "
            f"{length:.4g} mm long; give displacements in mm, final minus initial position"
        )
    spread, count, remarks = float(np.linalg.norm(np.ptp(points, axis=0))), len(points), []
    if not (apart := spread > 0.02 * length):  # within about the size of a disc
        told = "one marker was seen" if count == 1 else f"all {count} markers seen lie within {spread:.2g} mm"
        remarks.append(
            f"{told}: the measurements say what happens at one place, and nothing of the rest of the finger; "
            "errors at markers do not either"
        )
    if not moved.any():
        return [*remarks, "the measurements say that no marker moved"]
    linear = problem.material.model_copy(update={"law": "linear"})
    load = problem.load.as_mean() if problem.load.kind == "cylinder" else problem.load
    try:
        fem = make_solver("fem", estimate=False)
        expected = fem.solve(Problem(problem.mesh, linear, load)).displacement(points)
    except MissingLibraryError as error:
        return [*remarks, f"the measurements were not checked against fem: {error}"]
    stroke = float(np.abs(problem.load.values).max())
    if float(np.sqrt((expected**2).sum(axis=1).mean())) < SMALL * stroke:
        return remarks
    numbers = np.flatnonzero(seen) + 1
    mixed_up = _mixup_remarks(points, moved, expected, numbers) if apart else []
    return [*remarks, *_compared(moved, expected, stroke, numbers, apart=apart and not mixed_up), *mixed_up]


def _compared(
    moved: FloatArray, expected: FloatArray, stroke: float, numbers: IntArray, *, apart: bool
) -> list[str]:
    """Remarks on displacements of markers of `numbers`, (m,), beside those of `fem`, shapes (m, 2), mm.

    At one place, where markers are not `apart`, their direction says nothing: finite strain changes it.
    """
    sizes = float(np.linalg.norm(moved) * np.linalg.norm(expected))
    own = float((moved * expected).sum()) / sizes if apart else 1.0
    ratio = float(np.linalg.norm(moved) / np.linalg.norm(expected))
    sized = f"the markers' displacements are {ratio:.3g} times those of fem for a stroke of {stroke:g} mm"
    if own > UNLIKE and not 1 / IMPOSSIBLE < ratio < IMPOSSIBLE:
        raise UserError(f"{sized}, which no other stroke explains; give mm")
    remarks = []
    if not 1 / SIZES < ratio < SIZES:
        remarks.append(f"{sized}; check unit and stroke")
    elif (far := np.linalg.norm(moved, axis=1).max()) > SIZES * np.linalg.norm(expected, axis=1).max():
        number = numbers[np.linalg.norm(moved, axis=1).argmax()]
        remarks.append(f"marker {number} moved by {far:.4g} mm, {SIZES:g} times farther than any in fem")
    if own < UNLIKE:
        remarks.append(
            f"the markers' displacements are unlike those of fem (cosine {own:.2f}); check markers and load; "
            f"{CONVENTION}"
        )
    return remarks


def _mixup_remarks(
    points: FloatArray, moved: FloatArray, expected: FloatArray, numbers: IntArray
) -> list[str]:
    """A remark on markers whose displacements or pressed places much likelier have other signs or orders.

    Raises:
        UserError: If v has another sign, or u and v are exchanged.
    """
    like = expected * float(np.linalg.norm(moved) / np.linalg.norm(expected))
    signs = {
        "u of the other sign": moved * [-1, 1],
        "v of the other sign": moved * [1, -1],
        "other signs": -moved,
        "u and v exchanged": moved[:, ::-1],
        "u and v exchanged and other signs": -moved[:, ::-1],
    }
    given, *others = likelihoods(points, points + np.stack([moved, *signs.values()]) - like)
    gain, sign = max(zip((np.array(others) - given).tolist(), signs, strict=True))
    orders = {
        "displacements": likeliest_order(points, moved, expected=like),
        "pressed places": likeliest_order(points, points + moved, expected=points + like),
    }
    mixed = max(orders, key=lambda each: orders[each].gain)
    if gain > max(SURE, orders[mixed].gain):
        if sign.startswith("u of"):
            return [f"u goes against that of fem; {CONVENTION}"]
        raise UserError(
            f"the measurements do not fit the load: with {sign} they are much likelier; {CONVENTION}"
        )
    if not orders[mixed].gain:
        return []
    text = order_text(orders[mixed].order, [str(number) for number in numbers])
    return [f"the markers' {mixed} look mixed up: much likelier they are {text}; see how they are numbered"]


def _length(problem: Problem) -> float:
    """Length of the finger, mm."""
    return float(np.ptp(problem.mesh.points, axis=0).max())
