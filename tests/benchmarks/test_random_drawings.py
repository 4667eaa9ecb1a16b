"""Random drawings are read to 1e-6 of their area; the benchmark `reliability.drawings` tries more."""

from benchmarks.reliability.drawings import tried


def test_random_drawings_are_read_as_they_were_drawn() -> None:
    counts, wrong = tried(32)
    assert not wrong
    read = sum(number for (_, state), number in counts.items() if state.startswith("read"))
    assert read >= 28
    assert {suffix for suffix, state in counts if state == "read"} == {"dxf", "svg", "step", "msh"}
