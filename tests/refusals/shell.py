"""Files of the refused command lines, each wrong in one way."""

HEADER = "x_mm,y_mm,u_mm,v_mm"

BEAM = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="10mm" viewBox="0 0 60 10">'
    '<path d="M 0 0 H 60 V 10 H 0 Z"/></svg>'
)

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
    "file": "",
    "far.csv": f"{HEADER}\n20,-1,1e308,0\n",
    "underscore.csv": f"{HEADER}\n2_0,-1,0,0\n",
    "close.csv": f"{HEADER}\n20,-1,0,-5\n20.000000001,-1,0,5\n",
    "unsure.csv": f"{HEADER},std_u_mm\n20,-1,0,-5,1e-300\n",
    "beam.svg": BEAM,
    "finger.toml": "height = 95",
    "folder.vtu/kept": "",
    "foreign/thesis.txt": "three years of work",
}
