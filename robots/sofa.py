"""A SOFA scene of a finger: corotational tetrahedra that are held at the base, with a surface for contact.

Component names are those of SOFA 24, from its own examples: `TetrahedronFEMForceField.scn`,
`MeshGmshLoader.scn`, `Tetra2TriangleTopologicalMapping.scn`.
"""

from xml.etree import ElementTree as ET

from pinnray.robots.solid_mesh import SolidMesh
from pinnray.solvers.physics import Material

PLUGINS = (
    "Collision.Geometry",
    "Constraint.Projective",
    "IO.Mesh",
    "LinearSolver.Direct",
    "Mapping.Linear",
    "Mass",
    "ODESolver.Backward",
    "SolidMechanics.FEM.Elastic",
    "StateContainer",
    "Topology.Container.Dynamic",
    "Topology.Mapping",
    "Visual",
)
"""Modules of SOFA with the scene's components, after `Sofa.Component.`."""
TIME_STEP = 0.01
"""Of the implicit Euler method, s."""


def sofa_scene(mesh_file: str, body: SolidMesh, material: Material, density: float, damping: float) -> str:
    """The scene as XML.

    Args:
        mesh_file: Gmsh file of the tetrahedra, beside the scene, m.
        body: The tetrahedra in it.
        material: Elastic constants; the corotational law is linear in the turned frame of each element.
        density: Of the material, kg/m^3.
        damping: Rayleigh's factor of the stiffness, s.
    """
    root = ET.Element("Node", name="root", dt=f"{TIME_STEP:g}", gravity="0 0 0")
    for plugin in PLUGINS:
        ET.SubElement(root, "RequiredPlugin", name=f"Sofa.Component.{plugin}")
    ET.SubElement(root, "DefaultAnimationLoop")
    ET.SubElement(root, "VisualStyle", displayFlags="showBehaviorModels showForceFields showCollisionModels")
    finger = ET.SubElement(root, "Node", name="finger")
    ET.SubElement(finger, "EulerImplicitSolver", rayleighStiffness=f"{damping:.6g}", rayleighMass="0")
    ET.SubElement(finger, "SparseLDLSolver", template="CompressedRowSparseMatrixMat3x3d")
    ET.SubElement(finger, "MeshGmshLoader", name="loader", filename=mesh_file)
    ET.SubElement(  # without the loader's triangles, which are those of two groups only
        finger,
        "TetrahedronSetTopologyContainer",
        name="tetrahedra",
        position="@loader.position",
        tetrahedra="@loader.tetrahedra",
    )
    ET.SubElement(finger, "TetrahedronSetTopologyModifier")
    ET.SubElement(finger, "TetrahedronSetGeometryAlgorithms", template="Vec3")
    ET.SubElement(finger, "MechanicalObject", name="nodes", template="Vec3", position="@loader.position")
    ET.SubElement(finger, "UniformMass", totalMass=f"{density * body.volume:.6g}")
    ET.SubElement(
        finger,
        "TetrahedronFEMForceField",
        name="material",
        template="Vec3",
        method="large",
        youngModulus=f"{1e6 * material.young:.6g}",
        poissonRatio=f"{material.poisson:g}",
    )
    held = " ".join(map(str, body.nodes_on("base")))
    ET.SubElement(finger, "FixedProjectiveConstraint", name="base", template="Vec3", indices=held)
    surface = ET.SubElement(finger, "Node", name="surface")
    ET.SubElement(surface, "TriangleSetTopologyContainer", name="triangles")
    ET.SubElement(surface, "TriangleSetTopologyModifier")
    ET.SubElement(surface, "TriangleSetGeometryAlgorithms", template="Vec3")
    ET.SubElement(surface, "Tetra2TriangleTopologicalMapping", input="@../tetrahedra", output="@triangles")
    ET.SubElement(surface, "MechanicalObject", name="skin", template="Vec3")
    ET.SubElement(surface, "TriangleCollisionModel")
    ET.SubElement(surface, "IdentityMapping", input="@../nodes", output="@skin")
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
