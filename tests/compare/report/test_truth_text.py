from dataclasses import replace

from compare.report.text import truth_sentences


def test_what_the_markers_change_is_said_of_displacement_stress_and_force(fem, pinn, compared):
    """The truth is the reference times 1.1; the stress of the solver that was given markers is tripled."""
    given = replace(pinn, in_sample=True, von_mises=3 * pinn.von_mises)
    plain, changed, answer = truth_sentences(compared(fem, given, truth=pinn))
    assert plain == (
        "fem, which was given none: displacement 9.09\xa0%, von Mises stress 9.09\xa0%, "
        "force 9.09\xa0% "
        "away from the simulated finger."
    )
    assert changed == (
        "pinn-std, given the markers: displacement 0\xa0% (nearer), von Mises stress 200\xa0% (farther), "
        "force 0\xa0% (nearer)."
    )
    assert answer == (
        "Nearer than fem in displacement: pinn-std. Nearer in von Mises stress: none. "
        "Nearer in the indenter's force: pinn-std."
    )


def test_there_is_nothing_to_say_without_a_truth_or_a_solver_with_markers(fem, pinn, compared):
    given = replace(pinn, in_sample=True)
    assert truth_sentences(compared(fem, given)) == []
    assert truth_sentences(compared(fem, pinn, truth=pinn)) == []
    assert truth_sentences(compared(given, fem, truth=pinn)) == []
