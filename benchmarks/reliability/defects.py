"""The defects that faults, random input and mutants have shown, each with the test that guards its mend."""

DEFECTS = (
    (
        "kill",
        "Between the removal of its mark and its rename a finished folder barred every later run.",
        "`test_output_folder.py`, two renames, in one step",
    ),
    (
        "reading",
        "While the last result was removed, its mark went first: every later run was refused.",
        "`test_output_folder.py`, replaces the last result",
    ),
    (
        "kill",
        "Between two renames the last result was left under a hidden name, and a later run that failed did "
        "not give it back. Both names are now exchanged in one step, where the file system can.",
        "`test_output_folder.py`, two renames, in one step",
    ),
    (
        "reading",
        "Where the second rename failed, so did the last result: it stayed under a hidden name.",
        "`test_output_folder.py`, a rename that fails",
    ),
    (
        "reading",
        "A training that was being taken over from an earlier run, cut off, passed for the whole one.",
        "`test_output_folder.py`, a copy of a training",
    ),
    (
        "reading",
        "A sweep killed before it had written its definition left a journal, and its folder was refused.",
        "`test_resumable_folder.py`",
    ),
    (
        "reading",
        "A search, sweep or cross-validation killed while it wrote its definition was refused, too.",
        "`test_resumable_folder.py`",
    ),
    (
        "reading",
        "Two runs in containers, whose processes have equal numbers, wrote the same temporary file of a "
        "cache that they shared.",
        "`test_atomic.py`, two processes",
    ),
    (
        "reading",
        "A run that opened an unfinished folder in the moment it got its final name held no lock.",
        "`test_output_folder.py`, its final name",
    ),
    (
        "random input",
        "A whole number of hundreds of digits, given from Python, ended with an `OverflowError`.",
        "`test_design.py`, more digits",
    ),
    (
        "fuzzing",
        "A camera file whose table of keys was broken ended with an error of OpenCV.",
        "`test_camera.py`, one line",
    ),
    (
        "fuzzing",
        "An SVG element that contained itself ended with a `RecursionError`, or, where its link began with "
        "another sign than `#`, not at all.",
        "`test_bad_drawings.py`, contains itself",
    ),
    (
        "fuzzing",
        "An SVG file of thirty lines with copies of copies took all time and memory.",
        "`test_bad_drawings.py`, copies of copies",
    ),
    (
        "fuzzing",
        "A PNG of a hundred bytes that speaks of gigabytes of pixels, or in one chunk, took 17 s and 3.3 GB.",
        "`test_pictures.py`, gigabytes",
    ),
    (
        "fuzzing",
        "An SVG path without data or start, a height of zero, or a DXF entity of an unknown kind ended with "
        "a `TypeError`, `AttributeError`, `ZeroDivisionError` or `DXFAttributeError`.",
        "`test_bad_drawings.py`, stumbles over, unknown entity",
    ),
    (
        "fuzzing",
        "The end of a study's range that is no number, `from = nan`, ended with a `KeyError`.",
        "`test_study.py`, an end that is no number",
    ),
    (
        "fuzzing",
        "A DXF file whose header lacks a value ended with an `IndexError` or `ValueError`.",
        "`test_bad_drawings.py`, damaged header",
    ),
    (
        "kill",
        "Half-written files that kills left in the cache stayed there for ever; they go after a day.",
        "`test_cache.py`, nothing but the result",
    ),
    (
        "kill",
        "An empty folder that was left of the last result barred every later run.",
        "`test_output_folder.py`, replaces the last result",
    ),
    (
        "failed call",
        "A full disk or failed call in a process of `crossval` or `gridsearch` ended with a traceback.",
        "`test_processes.py`, cannot be written",
    ),
    (
        "failed call",
        "A full disk under a checkpoint of a training ended with a `SafetensorError` and a traceback.",
        "`test_pinn_training.py`, names the checkpoint",
    ),
    (
        "failed call",
        "After the last rename had failed, `--resume` was refused beside the complete result.",
        "`test_output_folder.py`, a rename that fails",
    ),
    (
        "fuzzing",
        "A camera file in YAML with words after the mark of its first document: OpenCV's reader never ended.",
        "`test_camera.py`, opencv cannot take",
    ),
    (
        "fuzzing",
        "A PNG of a hundred bytes with two headers and no pixels: OpenCV took 4 GB and 3.5 s.",
        "`test_pictures.py`, unreadable",
    ),
    (
        "fuzzing",
        "A workspace file with a line break in an unknown key was refused in two lines.",
        "`test_workspace.py`, one line",
    ),
    (
        "fuzzing",
        "An SVG or DXF curve with an infinite or huge coordinate was halved without end, as one far from the "
        "origin, where rounding hides its shape.",
        "`test_bad_drawings.py`, numbers without bounds",
    ),
    (
        "fuzzing",
        "An SVG file with a width of `10E` or below zero, an infinite scale, or another outermost element "
        "ended with a `ValueError`, `IndexError`, `LinAlgError` or `AttributeError`.",
        "`test_bad_drawings.py`, numbers without bounds, outermost element",
    ),
    (
        "random input",
        "A drawing whose whole boundary was called `front` ended with an `IndexError`.",
        "`test_bad_drawings.py`, all is called front",
    ),
    (
        "random input",
        "A drawing whose whole boundary was called `contact` had a contact of no width, and its mesh ended "
        "with a `KeyError`.",
        "`test_bad_drawings.py`, not the whole outline",
    ),
    (
        "random input",
        "A stroke or direction that was a list, from Python or a study, ended with a `TypeError`.",
        "`test_problem.py`, a travel is a number",
    ),
    (
        "random input",
        "A rounding of 1e-300 mm ended with a `ZeroDivisionError`, one of 1e-9 mm was meshed for minutes. "
        "They are refused now: 0 leaves it out, or 0.01 mm at least.",
        "`test_design.py`, left out or there",
    ),
    (
        "hostile file",
        "A file called `.msh` that was none, or one beside a mesh called `.msh.opt`, was run by Gmsh as a "
        "script, which could start any program.",
        "`test_readers.py`, no script of gmsh",
    ),
    (
        "torn write",
        "A run of `statfem` in some eighty differed by a millionth from the same run: NumPy rounds the "
        "logarithms of a diagonal by what lies beside it in memory, and a search enlarged that.",
        "`test_statistical_fem.py`, the same to the bit",
    ),
    (
        "fuzzing",
        "A damaged FFV1 video corrupted memory, one time in some thousand: FFmpeg's threads each decoded a "
        "frame of their own. Now they share one.",
        "`test_video.py`, threads of ffv1",
    ),
    (
        "reading",
        "A file without pictures that was taken for a video stayed open.",
        "`test_video.py`, without pictures",
    ),
    (
        "hostile file",
        "A module in the working folder, such as `selectors.py` beside a drawing of others, was run by the "
        "process for CAD and meshing, and by those of `sweep`, `crossval` and `gridsearch`.",
        "`test_working_folder.py`, no module",
    ),
    (
        "hostile file",
        "A `.petscrc` in the working folder had PETSc, also that in Gmsh, load a library or write any file; "
        "`dolfinx_jit_options.json` and `ffcx_options.json` chose the flags of the compiler and what it "
        "compiled.",
        "`test_working_folder.py`, no options",
    ),
    (
        "hostile file",
        "A film that was a play list, or had a name such as `concat:a.mkv` or `http:a`, had FFmpeg read "
        "other files or ask the network.",
        "`test_video.py`, opens nothing",
    ),
    (
        "hostile file",
        "A film of a megabyte whose frames have 256 million pixels took 1.5 GB.",
        "`test_video.py`, larger than any camera",
    ),
    (
        "hostile file",
        "The parts of a STEP assembly were read from other files, of any folder, that it named.",
        "`test_bad_drawings.py`, reads no other file",
    ),
    (
        "hostile file",
        "A link in an unfinished folder or a resumable one that somebody else had made was followed: all "
        "files where it led were removed, and results were written there.",
        "`test_output_folder.py`, `test_resumable_folder.py`, a link",
    ),
    (
        "hostile file",
        "The folder of a sweep that somebody else had made could have SQLite remove any file: a rollback "
        "journal names it.",
        "`test_sweep.py`, removes no file",
    ),
    (
        "hostile file",
        "A picture in a run of others that was a link to any file, or EPS, was put into the page of "
        "`report` as it is, or had Pillow start Ghostscript.",
        "`test_foreign_text.py`, pictures alone, a link",
    ),
    (
        "hostile file",
        "A `matplotlibrc` in the working folder had matplotlib start LaTeX, which reads any file that it "
        "names.",
        "`test_working_folder.py`, no settings",
    ),
    (
        "hostile file",
        "A file for `compare --from` could choose any folder of the machine as the output folder, and "
        "replace a result there.",
        "`test_options_file.py`, one line",
    ),
    (
        "hostile file",
        "Texts of files of others, such as a misspelt key, were printed with their control characters, and "
        "a terminal obeys them; in a table a spreadsheet took them for formulas.",
        "`test_foreign_text.py`, no formula",
    ),
    (
        "hostile file",
        "An archive of CAD files in a cache that somebody else had filled could name files of any folder, "
        "which were written.",
        "`test_cache.py`, stay in the output folder",
    ),
    (
        "trying",
        "`fem` at Poisson's ratio 0.499999999999 gave an energy a third too large as converged: rounding "
        "had spoilt the factors. A direct solution whose residual is above a thousandth of the load is "
        "refused.",
        "`test_fem.py`, rounding has spoilt",
    ),
    (
        "trying",
        "A stroke of 1e-200 mm, given from Python, ended with a `ZeroDivisionError`.",
        "`test_problem.py`, materials and loads",
    ),
    (
        "trying",
        "With a tolerance of 1e30, `fem-nonlinear` took the linear guess for an equilibrium: converged after "
        "no iteration. Tolerances above 0.001 are refused.",
        "`test_fem_nonlinear.py`, takes any state",
    ),
    (
        "trying",
        "`pr.compare` under a load that does not move ended with a `ZeroDivisionError`.",
        "`test_front_door.py`, a wrong input",
    ),
    (
        "trying",
        "`pr.solve` said nothing of a body that goes through itself, of units, or of measurements in metres.",
        "`test_front_door.py`, no real finger, another unit, impossible measurements",
    ),
    (
        "trying",
        "Observations of which no marker is visible, or with nine at one place, ended with a `ValueError` "
        "or as well determined.",
        "`test_solver.py`, none was seen; `test_plausibility.py`, cannot be, one place",
    ),
    (
        "trying",
        "One marker near the tip was refused: its direction, which finite strain changes, looked swapped.",
        "`test_plausibility.py`, one place",
    ),
    (
        "trying",
        "`crossval` said neither which solver did not converge nor that a body goes through itself, and "
        "nothing of units.",
        "`test_crossval.py`, speaks against",
    ),
    (
        "trying",
        "A prediction or refit of another package's solver that is no number made a mean `nan`.",
        "`test_solver.py`, prediction without it, refit; `test_crossval.py`, no number; "
        "`test_deformed_body.py`, not finite",
    ),
    (
        "trying",
        "`sweep` said nothing of bodies through themselves or units, and left what is no number out of "
        "its medians.",
        "`test_sweep.py`, goes wrong, no number",
    ),
    (
        "fuzzing",
        "A mesh with the name of a group that is not in UTF-8 ended with a `UnicodeDecodeError`.",
        "`test_readers.py`, names of groups",
    ),
    (
        "trying",
        "A board whose square was given in metres calibrated a camera without a word.",
        "`test_board.py`, an impossible board",
    ),
    (
        "mutant",
        "A workspace of exactly four fiducials was named by rounding, because any four discs fit in any "
        "turn: of 100 views of a layout near a parallelogram 51 were right. The discs' sizes count now.",
        "`test_fiducial_matching.py`, sizes",
    ),
    (
        "mutant",
        "A film whose fiducials at both ends lie in a row, while its camera moved, ended with a `TypeError`, "
        "or was refused.",
        "`test_camera_motion.py`, `test_plane_fit.py`, in a row",
    ),
    (
        "mutant",
        "A film skipped the search for lost markers in its second frame, and a camera waited a frame too "
        "long.",
        "`test_frame_tracker.py`, lacks",
    ),
    (
        "hostile file",
        "A `metrics.json` of others that lacked a number ended `report` with a traceback.",
        "`test_runs.py`, lacks a number",
    ),
    (
        "trying",
        "After a sweep from Python its workers' environment stayed in the caller's process: one thread of "
        "linear algebra for all that it started later.",
        "`test_working_folder.py`, workers of a sweep",
    ),
    (
        "fuzzing",
        "A mesh with every solid element twice ended with an `IndexError`.",
        "`test_readers.py`, without a boundary",
    ),
    (
        "fuzzing",
        "An element of a damaged mesh with a node that was not there took the last node for it, or ended "
        "with an `IndexError`.",
        "`test_readers.py`, the file lacks",
    ),
)
"""Found by, what happened, test."""
