"""Files of the refused command lines, each wrong in one way."""

import cv2
import numpy as np

HEADER = "x_mm,y_mm,u_mm,v_mm"

BEAM = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="10mm" viewBox="0 0 60 10">'
    '<path d="M 0 0 H 60 V 10 H 0 Z"/></svg>'
)

PICTURE = cv2.imencode(".png", np.full((80, 160, 3), 210, np.uint8))[1].tobytes()
"""Light grey, 160 by 80 pixels."""

FILES: dict[str, str | bytes] = {
    "broken.toml": "height = = 90",
    "other.toml": "hight = 90",
    "column.csv": "x_mm,y_mm,u_mm\n20,-1,0\n",
    "text.csv": f"{HEADER}\n20,-1,left,0\n",
    "nan.csv": f"{HEADER}\n20,-1,nan,0\n",
    "outside.csv": f"{HEADER}\n10,-10,0,0\n",
    "unseen.csv": f"{HEADER},visible\n20,-1,,,0\n",
    "flag.csv": f"{HEADER},visible\n20,-1,0,0,2\n",
    "header.csv": f"{HEADER}\n",
    "empty.csv": "",
    "binary.csv": bytes(range(256)),
    "good.csv": f"{HEADER}\n20,-1,0,-5\n85,-1,-2,-0.5\n",
    "weighed.csv": f"# weighed: heavy\n{HEADER}\n20,-1,0,-5\n",
    "taught.toml": '[learned]\npictures = 1\nunknowns = ["young"]\n',
    "file": "",
    "far.csv": f"{HEADER}\n20,-1,1e308,0\n",
    "underscore.csv": f"{HEADER}\n2_0,-1,0,0\n",
    "close.csv": f"{HEADER}\n20,-1,0,-5\n20.000000001,-1,0,5\n",
    "unsure.csv": f"{HEADER},std_u_mm\n20,-1,0,-5,1e-300\n",
    "beam.svg": BEAM,
    "finger.toml": "height = 95",
    "folder.vtu/kept": "",
    "foreign/thesis.txt": "three years of work",
    "film.mkv": "no film",
    "shots/1.png": PICTURE,
    "half.json": '{"fiducials": [',
    "strip.csv": "strain,stress_MPa\n0.1,1\n0.2,2\n0.3,3\n",
    "options/misspelt.toml": '[options]\nsolverz = "fem"',
    "options/design.toml": '[options]\ndesign = "none-such"',
    "options/solvers.json": '{"options": {"solvers": "none-such", "mesh-size": 1}}',
    "options/no table.toml": "mesh-size = 1",
    "options/outside.toml": "mesh-size = 1\n[options]",
    "options/elsewhere.toml": '[options]\nout = "/tmp/other"',
    "options/above.toml": '[options]\nout = ["a/../../other"]',
    "options/later.toml": "schema = 2\n[options]",
    "options/broken.toml": "[options",
}
