"""Sub-pixel centres of discs against the Cramér-Rao bound, with the paper's Hough circles beside them.

Exactly drawn discs at random places within a pixel, with noise. The bound follows from the derivatives of the
drawn picture with respect to all unknowns: place, size and shape of the disc, levels, blur, gradient of the
light, straight edges. One minute; writes `docs/evidence/localisation.md`.
"""

import time
from dataclasses import dataclass, replace
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS, fill, made_by, markdown
from compare.runtime.tables import terminal_table
from geometry.arrays import FloatArray
from tests.vision.discs.disc_images import DiscImage, Edge
from vision.discs.circle_proposals import propose_circles
from vision.discs.disc_fit import KNOWN_RADIUS, fit_discs
from vision.frames.frame import GreyImage

REPORT = DOCS / "evidence" / "localisation.md"
SEED, PLACES = 1, 500
ROW = 25
"""Number of discs side by side in a picture."""

HEADER = (
    *("case", "found, %", "rms, px", "bias, px", "bound, px", "rms / bound", "closed form, px"),
    *("within 1 sd, %", "1.96 sd, %", "Hough rms, px"),
)


@dataclass(frozen=True)
class Case:
    """Discs of one kind, and the disturbances of their picture."""

    image: DiscImage
    noise: float = 2.0
    known: bool = False
    codec: str = ""


def _wall(level: float, **values: float) -> DiscImage:
    """A disc on a wall of 2 mm, whose edges are 1.9 pixels from the disc, before a ground of a grey level."""
    across = 20 * (np.cos(0.4) + np.sin(0.4))
    edges = (Edge(0.4, across + 9.9, level), Edge(0.4 + np.pi, 9.9 - across, level))
    return DiscImage(edges=edges, **values)


def _hidden(offset: float, level: float) -> DiscImage:
    return DiscImage(edges=(Edge(0.0, offset, level, occludes=True),))


CASES = {
    "clean, radius 8 px": Case(DiscImage()),
    "radius 3 px": Case(DiscImage(radius=3.0)),
    "radius 20 px": Case(DiscImage(radius=20.0, centre=(33.0, 33.0), size=(67, 67))),
    "adverse: noise 6, blur 1.5 px": Case(DiscImage(blur=1.5), noise=6.0),
    "light on dark": Case(DiscImage(light=60.0, dark=180.0)),
    "light changes by 30 % over the disc": Case(DiscImage(gradient=(0.015, -0.011))),
    "tilt of 5 degrees": Case(DiscImage(stretch=1 / np.cos(np.deg2rad(5)), turn=0.3)),
    "strain of 10 %": Case(DiscImage(stretch=1.16, turn=0.7)),
    "wall of 2 mm, dark ground": Case(_wall(20.0)),
    "wall of 2 mm, light ground": Case(_wall(240.0)),
    "wall of 2 mm, dark ground, blur 1.5 px": Case(_wall(20.0, blur=1.5)),
    "wall, blur 1.5 px, noise 6": Case(_wall(20.0, blur=1.5), noise=6.0),
    "quarter hidden, radius known": Case(_hidden(24.0, 120.0), known=True),
    "half hidden, radius known": Case(_hidden(20.0, 120.0), known=True),
    "JPEG, quality 95": Case(DiscImage(), codec="jpg 95"),
    "JPEG, quality 75": Case(DiscImage(), codec="jpg 75"),
    "mp4v": Case(DiscImage(), codec="mp4v"),
}


def main() -> Table:
    """Measure and write the page's table."""
    rows = [(name, *_measured(case)) for name, case in CASES.items()]
    speeds = ", ".join(
        f"16 discs ({name}) in {_milliseconds(image):.1f} ms"
        for name, image in {"clean": DiscImage(), "wall": _wall(20.0)}.items()
    )
    made = f"{made_by('localisation')}, OpenCV {cv2.__version__}, seed {SEED}"
    said = f"{made}; on one core {speeds} of processor time, the best of twenty."
    fill(REPORT, "figures", f"{said}\n\n{markdown(HEADER, rows)}")
    return terminal_table(f"{PLACES} places each; {speeds}", HEADER, rows, left=["case"])


def _measured(case: Case) -> tuple[str, ...]:
    rng = np.random.default_rng(SEED)
    errors, scores, circles = [], [], []
    radius = case.image.radius
    for _ in range(PLACES // ROW):
        picture, centres = _sheet(case, ROW, rng)
        guesses = np.column_stack([centres + rng.normal(0, 0.4, centres.shape), np.full(ROW, radius)])
        discs = fit_discs(picture, guesses, radii=radius if case.known else None)
        wrong = (discs.centres - centres)[discs.found]
        errors.append(wrong)
        scores.append(wrong / np.sqrt(np.diagonal(discs.covariances[discs.found], axis1=1, axis2=2)))
        circles.append(_nearest(propose_circles(picture, radii=(0.8 * radius, 1.2 * radius)), centres))
    error, score, circle = (np.concatenate(part) for part in (errors, scores, circles))
    rms, bound = _rms(error), _bound(case)
    blur, contrast = np.hypot(case.image.blur, 12**-0.5), abs(case.image.light - case.image.dark)
    closed = 2 * case.noise / contrast * np.sqrt(blur / (radius * np.sqrt(np.pi)))
    return (
        f"{100 * len(error) / PLACES:.1f}",
        f"{rms:.4f}",
        f"{np.hypot(*error.mean(axis=0)):.4f}",
        f"{bound:.4f}",
        f"{rms / bound:.2f}",
        f"{closed:.4f}",
        f"{100 * (np.abs(score) < 1).mean():.0f}",
        f"{100 * (np.abs(score) < 1.96).mean():.0f}",
        f"{_rms(circle):.2f} ({100 * len(circle) / PLACES:.0f} %)" if len(circle) else "none",
    )


def _sheet(case: Case, count: int, rng: np.random.Generator) -> tuple[GreyImage, FloatArray]:
    """A picture of discs side by side, through the codec, and their centres."""
    centres = case.image.centre + rng.uniform(-0.5, 0.5, (count, 2))
    tiles = [replace(case.image, centre=tuple(centre)).noisy(case.noise, rng) for centre in centres]
    centres[:, 0] += case.image.size[0] * np.arange(count)
    return _coded(np.hstack(tiles), case.codec), centres


def _coded(picture: GreyImage, codec: str) -> GreyImage:
    if codec.startswith("jpg"):
        _, content = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(codec.split()[1])])
        return cv2.imdecode(content, cv2.IMREAD_GRAYSCALE)
    if codec:
        height, width = (16 * -(-side // 16) for side in picture.shape)
        rest = [(0, height - picture.shape[0]), (0, width - picture.shape[1])]
        padded = np.pad(picture, rest, mode="edge")
        with TemporaryDirectory() as folder:
            path = f"{folder}/one.mp4"
            writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*codec), 30, (width, height))
            writer.write(cv2.cvtColor(padded, cv2.COLOR_GRAY2BGR))
            writer.release()
            _, frame = cv2.VideoCapture(path).read()
        return cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)[: picture.shape[0], : picture.shape[1]]
    return picture


def _bound(case: Case) -> float:
    """Least root mean square distance of an unbiased estimate, pixels."""
    image, step = case.image, 1e-4  # of central differences, pixels, or relative
    names = [(name, place) for name in ("centre", "gradient") for place in (0, 1)]
    names += [(name,) for name in ("light", "dark", "blur", "radius", "stretch", "turn")]
    names += [("edges", n, at) for n in range(len(image.edges)) for at in ("angle", "offset", "level")]
    slopes = np.array(
        [np.ravel(_moved(image, *name, step) - _moved(image, *name, -step)) / (2 * step) for name in names]
    )
    information = slopes @ slopes.T / (case.noise**2 + 1 / 12)
    if case.known:
        radius = names.index(("radius",))
        information[radius, radius] += (KNOWN_RADIUS * image.radius) ** -2
    return float(np.sqrt(np.trace(np.linalg.inv(information)[:2, :2])))


def _moved(image: DiscImage, name: str, *rest: Any) -> FloatArray:
    """The exact picture with one of its unknowns changed; of a circle, a turned stretch is one of them."""
    *place, change = rest
    value = getattr(image, name)
    if name == "turn" and image.stretch == 1:
        return replace(image, stretch=1 + change, turn=np.pi / 4).exact()
    if name == "edges":
        number, of = place
        changed = replace(value[number], **{of: getattr(value[number], of) + change})
        new = (*value[:number], changed, *value[number + 1 :])
    elif place:
        new = tuple(each + change * (at == place[0]) for at, each in enumerate(value))
    else:
        new = value + change
    return replace(image, **{name: new}).exact()


def _milliseconds(image: DiscImage, count: int = 16) -> float:
    """Processor time of a batch on one core, the best of twenty."""
    cv2.setNumThreads(1)
    picture, centres = _sheet(Case(image), count, np.random.default_rng(SEED))
    guesses = np.column_stack([centres + 0.5, np.full(count, image.radius)])
    seconds = []
    for _ in range(20):
        started = time.process_time()
        fit_discs(picture, guesses, radii=image.radius)
        seconds.append(time.process_time() - started)
    return 1e3 * min(seconds)


def _nearest(circles: FloatArray, centres: FloatArray) -> FloatArray:
    """Errors of the circles that are nearest to the centres, at most 3 pixels away."""
    if not len(circles):
        return np.empty((0, 2))
    errors = circles[:, None, :2] - centres
    away = np.linalg.norm(errors, axis=2)
    best = away.argmin(axis=0)
    each = np.arange(len(centres))
    return errors[best, each][away[best, each] < 3]


def _rms(errors: FloatArray) -> float:
    """Root mean square distance."""
    return float(np.sqrt((errors**2).sum(axis=1).mean()))
