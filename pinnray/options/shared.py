"""Options that several commands share, and the objects that they describe."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter
from pydantic import Field

from pinnray.film.film import FilmSettings
from pinnray.geometry.finger.parameters import CheckedModel
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import errors_of_interruption, say
from pinnray.runtime.machine import process_count
from pinnray.solvers.load import LoadKind, Physics
from pinnray.solvers.material import Material

if TYPE_CHECKING:  # `--help` has to be quick: what options describe is imported when they are read
    from pinnray.geometry.finger.design import Design
    from pinnray.geometry.finger.finger import Finger
    from pinnray.geometry.finger.learned import Learned
    from pinnray.geometry.mesh.settings import MeshSettings
    from pinnray.solvers.load import Load
    from pinnray.solvers.solver import Solver
    from pinnray.studies.sweep.job import S, StudyJob

FINGER = Group("Finger", sort_key=1)
PHYSICS = Group("Physics", sort_key=2)
MEASURED = Group("Measured finger", sort_key=2, default_parameter=Parameter(show_default=False))
TRAINING = Group("Solvers' settings", sort_key=3)
OUTPUT = Group("Output", sort_key=4, default_parameter=Parameter(negative="", show_default=False))

Repeated = Annotated[tuple[str, ...], Parameter(negative="", show_default=False)]
Flag = Annotated[bool, Parameter(negative="", show_default=False)]
FilmOptions = Annotated[FilmSettings, Parameter(name="*", group=Group("Camera", sort_key=4))]
OutputFlag = Annotated[bool, Parameter(group=OUTPUT)]
OutputPath = Annotated[Path, Parameter(group=OUTPUT, show_default=True)]
OptionalOutputPath = Annotated[Path | None, Parameter(group=OUTPUT)]


@Parameter(name="*", group=FINGER)
class FingerOptions(CheckedModel):
    """The finger and its mesh.

    Attributes:
        design: Preset (default, csiro, slender, ...) or .toml file.
        section: A drawing instead of a design: a .step, .dxf or .svg file, or a .msh mesh. A .toml file of
            the same name beside it may say where it is clamped, touched and marked.
        clamp: Clamped part of the drawing's outline, such as "[[0,0],[0,-30]]"; default: the file's own, else
            proposed, as for the next two.
        contact: Point of the drawing's outline where the indenter touches, such as "[35,0]".
        markers: Centres of the markers on the drawing, such as "[[10,-1],[20,-1]]", or their number.
        set: Change a parameter, such as rib_count=6 or N=6; on a drawing a line of its description, such as
            depth=12; may be repeated.
        mesh_size: Element size in walls and ribs, mm, default 0.25; up to 4 times larger in the tip. A .msh
            file that is a mesh of the section is taken as it is unless a size is given.
        yes: Go on although the mesh is so fine that a run takes more than five minutes or much memory.
    """

    design: str = "default"
    section: Path | None = None
    clamp: str | None = None
    contact: str | None = None
    markers: str | None = None
    set: Repeated = ()
    mesh_size: float | None = None
    yes: Flag = False

    def read(
        self, preset: str | None = None, usual: "MeshSettings | None" = None
    ) -> "tuple[Finger, MeshSettings | None]":
        """The finger and its element sizes: of the option, the preset of the solvers, or as usual.

        The sizes are None for a finger whose file has a mesh, if neither option nor preset asks for any.
        """
        from pinnray.geometry.cache import mesh_sizes
        from pinnray.geometry.mesh.settings import MeshSettings
        from pinnray.options.preset_jobs import job_defaults

        asked = job_defaults(preset).mesh
        if self.mesh_size is not None:
            try:
                asked = MeshSettings(**{**(asked or MeshSettings()).model_dump(), "size": self.mesh_size})
            except UserError as error:
                raise UserError(f"--mesh-{error}") from None
        finger = self._designed() if self.section is None else self._drawn(self.section)
        return finger, mesh_sizes(finger, asked, usual)

    def learned(self) -> "Learned | None":
        """What the files that describe the finger say that pictures have taught of it."""
        from pinnray.geometry.finger.learned import read_learned

        tables = (read_learned(file) for file in self.files() if file.suffix == ".toml")
        return next(filter(None, tables), None)

    def files(self) -> list[Path]:
        """The files that describe the finger."""
        from pinnray.geometry.drawing.description import description_beside

        given = [Path(self.design), self.section, self.section and description_beside(self.section)]
        return [path for path in given if path is not None and path.is_file()]

    def check_cost(
        self,
        finger: "Finger",
        mesh: "MeshSettings | None",
        solvers: "Sequence[Solver]" = (),
        *,
        simulated: bool = False,
    ) -> None:
        """Raise a `UserError` with the price of a fine mesh, unless --yes is given; see `check_mesh_cost`."""
        if not self.yes:
            from pinnray.options.cost import check_mesh_cost

            check_mesh_cost(finger, mesh, solvers, simulated=simulated)

    @property
    def _places(self) -> dict[str, str]:
        """Where a drawing is held, touched and marked, as far as it is given."""
        given = {"clamp": self.clamp, "contact": self.contact, "markers": self.markers}
        return {name: text for name, text in given.items() if text is not None}

    def _designed(self) -> "Design":
        from pinnray.geometry.finger.presets import load_design, parse_overrides

        if self._places:
            raise UserError(f"--{next(iter(self._places))} belongs to a drawing; give it by --section FILE")
        changes = parse_overrides(self.set)
        design = load_design(self.design, changes)
        if changes and "name" not in changes:  # so that it has its own output folder
            design = design.replaced(name=_changed_name(design, changes))
        if design.small_markers:
            say(f"markers of {design.marker_diameter:g} mm: {design.small_markers}")
        return design

    def _drawn(self, file: Path) -> "Finger":
        from pinnray.geometry.cache import drawn_finger
        from pinnray.geometry.drawing.description import description_beside, load_description

        if self.design != "default":
            raise UserError(f"--section {file} and --design {self.design}: give one of them")
        places = [f"{name}={text}" for name, text in self._places.items()]
        settings = [setting.partition("=") for setting in (*places, *self.set)]
        keys = [key.strip() for key, _, _ in settings]
        if twice := [key for key in keys if keys.count(key) > 1]:
            raise UserError(f"{twice[0]} is set twice; give it once")
        lines = [f"{key} {equals} {value and toml_value(value.strip())}" for key, equals, value in settings]
        return drawn_finger(file, load_description(description_beside(file), lines))


def toml_value(text: str) -> str:
    """The text as a value of TOML: a number, list or quoted text as it is, any other in quotes."""
    try:
        tomllib.loads(f"value = {text}")
    except ValueError:
        return json.dumps(text)
    return text


def _changed_name(design: "Design", changes: Mapping[str, object]) -> str:
    """The preset's name with the changes, in the letters and the length that a name may have."""
    parts = (f"-{name}-{value}" for name, value in changes.items())
    name = design.name + re.sub(r"[^A-Za-z0-9._-]", "", "".join(parts))
    return name if len(name) <= 64 else f"{name[:55]}-{design.digest[:8]}"


class MaterialOptions(Material):
    """Elastic constants, or the name of a material that has them."""

    young: float | str = Field(  # type: ignore[assignment]
        default=11.4, description="Young's modulus [MPa]; 11.4±1.2 is known to a standard deviation of 1.2"
    )

    material: str | None = Field(
        default=None,
        description="Name of a filament or silicone, whose modulus and Poisson's ratio are taken unless they "
        "are given; `pinnray material` lists them",
    )

    def made(self) -> Material:
        """The material."""
        given = self.model_dump(exclude_unset=True, include=set(Material.model_fields))
        if self.material is None:
            return Material(**given)
        from pinnray.solvers.materials.presets import of_preset

        return of_preset(self.material, **given)


@Parameter(name="*", group=PHYSICS, negative="")
class PhysicsOptions(MaterialOptions, Physics):
    """Material and load."""

    def read(self, preset: str | None = None, usual_load: LoadKind | None = None) -> "tuple[Material, Load]":
        """Material and load; the command or a preset of the solvers may choose the kind that is usual."""
        return self.made(), Physics(**self.values(preset, usual_load)).parts[1]

    def values(self, preset: str | None = None, usual_load: LoadKind | None = None) -> dict[str, Any]:
        """What is not as by default, by the names of a study."""
        from pinnray.options.preset_jobs import job_defaults
        from pinnray.solvers.materials.presets import USUAL

        usual: dict[str, Any] = {"load": usual_load or job_defaults(preset).load}
        usual |= {name: getattr(self.made(), name) for name in USUAL if self.material}
        return usual | self.model_dump(exclude_unset=True, exclude={"material"})


@Parameter(name="*", group=MEASURED)
class PressOptions(CheckedModel):
    """Other pictures of the finger, and what they teach of it.

    Attributes:
        presses: Other pictures of the same finger under the same contact, CSV files with commas between them;
            what they say of walls, clamp and modulus, fem-id takes into its fit. One that was weighed has a
            line `# weighed: 2.62 ± 0.05 N`.
        weighed: Force along the stroke that a scale showed in the picture that is measured, such as
            2.62±0.05, N.
        learn: Design file to write, .toml, with what all pictures say of the finger; --design takes it.
    """

    presses: str = ""
    weighed: str | None = None
    learn: Path | None = None

    @property
    def files(self) -> list[Path]:
        """The files of the other pictures."""
        return [Path(name) for name in comma_list(self.presses)]


@Parameter(name="*", group=TRAINING)
class SolverOptions(CheckedModel):
    """Settings of the chosen solvers.

    Attributes:
        preset: Preset of pinn-std and pinn-asm. fast (default): random hidden weights, output layer solved
            exactly. local: likewise, with windows in place of gates. paper: the paper's training, 60,000
            epochs, many hours on a CPU; also takes the paper's uniform mesh of 91,006 nodes and --load point,
            unless --mesh-size or --load is given. trained: as local with fewer windows, but every weight is
            trained, one to four minutes by the linear law; no cylinder.
        solver_set: Change a setting of a solver, such as pinn-std.neurons=7; may be repeated.
        device: cpu (default) or cuda, for the solvers that can use either.
        seed: Seed of the random numbers.
    """

    preset: str | None = None
    solver_set: Repeated = ()
    device: str | None = None
    seed: int = 0

    def read(self, names: str) -> "list[Solver]":
        """The solvers with these names, separated by commas.

        Raises:
            UserError: If a solver, preset or setting does not exist or a text cannot be read.
        """
        from pinnray.options.solver_choice import made_solvers

        if self.seed < 0:
            raise UserError(f"--seed {self.seed}: give a whole number from 0")
        chosen = comma_list(names)
        shared = {"seed": self.seed} | ({} if self.device is None else {"device": self.device})
        solvers = made_solvers(chosen, self.preset, self.settings(chosen), **shared)
        if self.device is not None and not any("device" in solver.settings() for solver in solvers):
            raise UserError(f"--device {self.device}: none of the solvers {names} can choose a device")
        return solvers

    def settings(self, names: "Sequence[str]") -> dict[str, dict[str, object]]:
        """The settings of each of these solvers from texts such as `pinn-std.neurons=7`."""
        given: dict[str, dict[str, object]] = {name: {} for name in names}
        for text in self.solver_set:
            target, dot, rest = text.partition(".")
            key, equals, value = rest.partition("=")
            if not (dot and equals and key and value):
                raise UserError(
                    f"cannot read {text!r}; write solver.setting=value, such as pinn-std.neurons=7"
                )
            if target not in given:
                raise UserError(
                    f"{text!r} is for {target!r}, which is not among the solvers {', '.join(names)}"
                )
            if key in given[target]:
                raise UserError(f"{target}.{key} is set twice; set it once")
            given[target][key] = value
        return given


@Parameter(name="*")
class StudyOptions(CheckedModel):
    """Workers, pictures and folder of a study.

    Attributes:
        processes: Worker processes; default: one per core.
        pictures: Formats of the pictures besides PNG (default: none), separated by commas: svg, pdf.
        width: Width of the pictures, such as 85mm (a journal's column); default 140mm, with svg or pdf 180mm.
        out: Output folder; default: named after the command and the study, in out.
    """

    processes: int | None = None
    pictures: str = ""
    width: str | None = None
    out: OptionalOutputPath = None

    def job(self, study: "S", file: Path, kind: str) -> "StudyJob[S]":
        """The job of the study in a file."""
        from pinnray.studies.sweep.job import StudyJob

        out = self.out or Path("out") / f"{kind}-{study.name}"
        return StudyJob(study, file.parent, out, process_count(self.processes, "--processes"))


@contextmanager
def going_on_from(folder: Path) -> Iterator[None]:
    """Tell who interrupts the work inside that the same command goes on from what a folder keeps."""
    try:
        with errors_of_interruption():
            yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"the same command goes on from what {folder} keeps") from None


def comma_list(text: str) -> list[str]:
    """The words of a text with commas between them."""
    return [word for part in text.split(",") if (word := part.strip())]


def read_formats(options: StudyOptions) -> tuple[list[str], float]:
    """Formats of the pictures besides PNG, and their width, inches."""
    from pinnray.comparison.figures import check_formats, page_width

    check_formats(formats := comma_list(options.pictures))
    return formats, page_width(read_millimetres(options.width), formats)


def read_millimetres(text: str | None) -> float | None:
    """A width in mm from a number with or without its unit; None stays None."""
    if text is None:
        return None
    given = re.fullmatch(r"(\d+(?:\.\d+)?) *(mm|cm|in)?", text.strip())
    if given is None:
        raise UserError(f"--width {text}: give a number in mm, cm or in, such as 85mm")
    return float(given[1]) * {"cm": 10.0, "in": 25.4}.get(given[2], 1.0)


def existing_table(path: Path | None) -> Path | None:
    """The path, if it is None or a CSV file; else a `UserError`."""
    if path is not None and path.suffix.lower() != ".csv":
        raise UserError(
            f"--measurements {path}: this command takes a CSV file of displacements, and no film; "
            "`pinnray track` makes one from a film"
        )
    return path
