"""Presets, and moduli from tensile tests whose answer is known."""

import pickle
import warnings

import numpy as np
import pytest

from pinnray.commands.finger.material import command
from pinnray.runtime.errors import UserError
from pinnray.solvers.materials import MATERIALS, TensileTest, fitted, preset, read_tensile_test
from pinnray.solvers.materials.tensile_test import nominal_stress
from pinnray.solvers.registry import make_solver

STRAIN = np.linspace(0.02, 0.8, 40)


def test_a_neo_hookean_bar_that_keeps_its_volume_has_the_stress_of_the_textbook():
    """σ = E/3 (λ - λ⁻²) for an incompressible one (Treloar 1975, chapter 5); ν = 0.4999 is near it."""
    stretch = 1 + STRAIN
    found = nominal_stress("neo-hookean", STRAIN, 0.4999)
    np.testing.assert_allclose(found, (stretch - stretch**-2) / 3, rtol=2e-3)


def test_a_bar_of_st_venant_and_kirchhoff_has_the_stress_of_the_textbook():
    """Without transverse stress its second Piola-Kirchhoff stress is E times the Green-Lagrange strain."""
    stretch = 1 + STRAIN
    found = nominal_stress("st-venant-kirchhoff", STRAIN, 0.3)
    np.testing.assert_allclose(found, stretch * (stretch**2 - 1) / 2, rtol=1e-9)
    assert np.isnan(nominal_stress("st-venant-kirchhoff", np.array([0.9]), 0.45)).all()
    assert "st-venant-kirchhoff" not in {each.material.law for each in fitted(TensileTest(STRAIN, STRAIN))}


@pytest.mark.parametrize("law", ["linear", "neo-hookean", "st-venant-kirchhoff"])
def test_the_law_and_the_modulus_of_a_test_are_found_again(law):
    strain = 0.6 * STRAIN
    noise = 1 + 0.01 * np.random.default_rng(0).normal(size=len(strain))
    test = TensileTest(strain, 2.5 * nominal_stress(law, strain, 0.45) * noise)
    best, *others = fitted(test)
    assert best.material.law == law
    assert best.material.young == pytest.approx(2.5, rel=0.01)
    assert best.misfit < 0.02 < min(fit.misfit for fit in others)


def test_a_silicone_has_the_stress_of_its_sheet_at_twice_its_length():
    """Dragon Skin 30: 86 psi at a strain of 100 %; its Poisson's ratio of 0.49 costs 2 %."""
    material = preset("dragon-skin-30").material
    stress = material.young * nominal_stress("neo-hookean", np.array([1.0]), material.poisson)[0]
    assert stress == pytest.approx(86 * 0.006895, rel=0.03)
    for known in MATERIALS.values():
        assert "law" not in known.material.model_fields_set  # a linear solver has the linear one
        assert 0.9 < known.density < 1.4
        assert known.source
    with pytest.raises(UserError, match="no material 'tpu'; there are tpu-85a"):
        preset("tpu")


@pytest.mark.parametrize("name", ["TPU-85A", "TPU 85A", "tpu_85a"])
def test_a_material_is_known_as_its_maker_writes_it(name):
    assert preset(name) is preset("tpu-85a")


def test_a_test_is_read_with_the_units_of_its_columns(tmp_path):
    file = tmp_path / "strip.csv"
    file.write_text("# of a strip\nstrain_percent;stress_kPa\n0;0\n10;50\n20;100\n50;220\n")
    test = read_tensile_test(file)
    np.testing.assert_allclose(test.strain, [0.1, 0.2, 0.5])
    np.testing.assert_allclose(test.stress, [0.05, 0.1, 0.22])
    assert test.secant(0.2) == pytest.approx(0.5)
    assert np.isnan(test.secant(0.9))
    assert len(test.up_to(0.5).strain) == 3
    with pytest.raises(UserError, match=r"2 points have strains up to 0\.3"):
        test.up_to(0.3)


CURVE = [(0.02 * n, 0.2 * n) for n in range(1, 26)]
"""Strain, and stress in MPa, of a linear bar of 10 MPa up to a strain of 50 %."""


@pytest.mark.parametrize(
    ("titles", "strain", "stress"),
    [
        ("strain,stress_MPa", 1, 1),
        ("Engineering Strain;Engineering Stress (MPa)", 1, 1),
        ("True Stress (MPa);Engineering Strain;Engineering Stress [kPa]", 1, 1e3),
        ("Tensile strain (%),Tensile stress (MPa)", 100, 1),
        ("Strain\tStress\n(mm/mm)\t(N/mm²)", 1, 1),  # units below
        ("Dehnung in %;Spannung in MPa", 100, 1),
        ("strain_ratio,stress_Pa", 1, 1e6),
        ("ε / -;σ / kPa", 1, 1e3),
        ("Déformation (%);Contrainte en MPa", 100, 1),
        ("Technische Dehnung [%];Zugspannung [N/mm^2]", 100, 1),
        ("Tensile strain (Strain 1),Tensile stress\n(%),N/mm²", 100, 1),
    ],
)
def test_titles_of_many_programs_are_known(tmp_path, titles, strain, stress):
    file = tmp_path / "strip.csv"
    mark = next(each for each in ";\t," if each in titles)
    before = ["99"] * (titles.count("True"))
    rows = [mark.join([*before, f"{s * strain:.6g}", f"{p * stress:.6g}"]) for s, p in CURVE]
    rows = [row.replace(".", ",") if mark == ";" else row for row in rows]
    file.write_text(f"Specimen 1\nV2\n{titles}\n" + "\n".join(rows))
    best, *_ = fitted(read_tensile_test(file))
    assert best.material.law == "linear"
    assert best.material.young == pytest.approx(10)


def test_strains_that_may_be_per_cent_are_asked_about(tmp_path):
    file = tmp_path / "strip.csv"
    for title in ("strain", "strain_ratio"):
        file.write_text(f"{title},stress_MPa\n" + "".join(f"{10 * s},{p}\n" for s, p in CURVE))
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            read_tensile_test(file)
        assert [str(each.message) for each in said] == [
            f"{file}: strains up to 5 have no unit; are they per cent? Then call the column strain_percent, "
            "else strain_ratio"
        ] * (title == "strain")


@pytest.mark.parametrize(("preload", "said"), [(0, ""), (1, "no law is near the test")])
def test_a_preload_that_spoils_the_fit_is_told(tmp_path, capsys, preload, said):
    file = tmp_path / "strip.csv"
    file.write_text("strain,stress_MPa\n" + "".join(f"{s},{p + preload}\n" for s, p in CURVE))
    assert command(file) == 0
    err = capsys.readouterr().err
    assert said in err if said else not err


BACK = [(s, p - 1.0) for s, p in CURVE[::-1]]


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (CURVE, None),
        (CURVE[::-1], None),
        ([CURVE[n] for n in np.random.default_rng(0).permutation(25)], None),
        (CURVE + BACK, "its strain goes back; of its 50 points the 25"),
        (CURVE[:15] + BACK[10:] + CURVE + BACK, "its strain goes back"),  # two cycles
        (CURVE + [(0.5 + 0.02 * n, 0.01) for n in range(1, 20)], "its stress falls after the peak"),  # broke
    ],
)
def test_the_first_loading_up_to_the_peak_counts(tmp_path, recwarn, points, said):
    file = tmp_path / "strip.csv"
    file.write_text("strain,stress_MPa\n" + "".join(f"{s},{p}\n" for s, p in points))
    test = read_tensile_test(file)
    assert fitted(test)[0].material.young == pytest.approx(10)
    assert test.secant(0.25) == pytest.approx(10)
    assert [said in str(each.message) for each in recwarn] == [True] * (said is not None)


def test_a_known_material_carries_its_substance_through_options_and_laws():
    from pinnray.options.shared import PhysicsOptions
    from pinnray.solvers.solver import with_law

    known = preset("tpu-95a")
    assert (known.material.substance.density, known.material.substance.strain_at_break) == known[1:3]
    material, _ = PhysicsOptions(material="tpu-95a", young=20.0).read()
    assert (material.young, material.substance) == (20.0, known.material.substance)
    assert PhysicsOptions(young=20.0).read()[0].substance is None
    assert with_law(material, make_solver("fem")).substance == material.substance
    assert pickle.loads(pickle.dumps(material)).substance == material.substance
