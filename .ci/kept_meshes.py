"""A pytest plug-in that reads meshes from a cache, filled in an environment with CadQuery and Gmsh.

`MAKERS` holds the versions of that environment's packages, which are part of the cache keys. A test whose
mesh is not in the cache fails.
"""

import json
import os

from pinnray.geometry import cache

cache.package_version = json.loads(os.environ["MAKERS"]).__getitem__
