"""Springs that couple the hinges of a chain, fitted to displacements and forces of the finger.

The elastic energy is q . K q / 2 with a full matrix K: walls and ribs behind the front are in it. With a
spring at each hinge alone nothing beyond a contact would bend, and no tip would come around the indenter.

Units: m, N, rad, s.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from pinnray.robots.chain import MM, Chain
from pinnray.robots.presses import PressedFinger
from pinnray.runtime.arrays import FloatArray

SMALL_WEIGHT = 0.01
"""Weight of a small load in the fit: they decide only what pressing does not, such as pulls along it."""


@dataclass(frozen=True, eq=False)
class Springs:
    """The vibrations of a chain. A fixed tendon for each pulls with k times its length a . q.

    K is the sum of k a a^T. As each tendon is one vibration, damping it by the loss factor times k over its
    angular frequency gives every vibration this loss factor.
    """

    rows: FloatArray  #: Coefficients a, each of length one, shape (n + 1, n + 1)
    stiffnesses: FloatArray  #: k, shape (n + 1,), N m or N/m by the coordinates that a has most of
    frequencies: FloatArray  #: Angular frequencies, rising, shape (n + 1,), rad/s


def fitted_springs(chain: Chain, finger: PressedFinger, *, fastest: float) -> Springs:
    """Springs by which the chain takes the finger's shapes under the finger's forces.

    The compliance C = K^-1 minimises the mean squared distance of the front's points from the finger's over
    the square of how far the load moves them, by linear least squares in the coordinates that fit each shape.

    Args:
        chain: The links.
        finger: The loads.
        fastest: Largest angular frequency, rad/s, which bounds the simulator's time step. Vibrations that
            are faster, or to which least squares would give a negative stiffness, get this one.
    """
    rest = MM * finger.front
    bent, pulled, weights = [], [], []
    for loads, weight in ((finger.small, SMALL_WEIGHT), (finger.fitted, 1.0)):
        for each in loads:
            q = chain.bent_as(rest, MM * each.moved)
            place = MM * np.array([[each.force_place, np.interp(each.force_place, *finger.front.T)]])
            bent.append(q)
            pulled.append(chain.placed(q, place)[1][0].T @ each.force)
            weights.append(weight / (MM * np.linalg.norm(each.moved, axis=1).mean()) ** 2)
    q, force, weighed = np.array(bent), np.array(pulled), np.array(weights)[:, None] * np.array(pulled)
    slopes = chain.placed(np.zeros(chain.hinges + 1), rest)[1]
    metric = np.einsum("mik,mil->kl", slopes, slopes) / len(rest)
    # The least squares are stationary for symmetric C where G C F + F C G = G Q + Q^T G.
    mixed = metric @ q.T @ weighed
    compliance = _symmetric(metric, force.T @ weighed, mixed + mixed.T)
    root = np.linalg.cholesky(chain.inertia)
    shares, modes = eigh(root.T @ compliance @ root)
    slow = np.maximum(shares[::-1], fastest**-2.0)
    rows = (root @ modes[:, ::-1]).T
    lengths = np.linalg.norm(rows, axis=1)
    return Springs(rows / lengths[:, None], lengths**2 / slow, slow**-0.5)


def _symmetric(metric: FloatArray, forces: FloatArray, right: FloatArray) -> FloatArray:
    """C with G C F + F C G = right, in the eigenvectors that G and F share."""
    values, vectors = eigh(forces, metric)
    inner = vectors.T @ right @ vectors
    ridge = 1e-9 * values.max()  # for loads that no force excites
    return np.asarray(vectors @ (inner / (values[:, None] + values + ridge)) @ vectors.T)
