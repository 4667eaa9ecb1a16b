"""The table of films under stress can be made in parts."""

from pathlib import Path

import pytest

from benchmarks.tables import fill, markdown
from benchmarks.tracker import stress
from pinnray.runtime.errors import UserError


def test_rows_that_are_not_made_anew_stay_on_the_page(tmp_path: Path, monkeypatch) -> None:
    rows = stress.reported()
    assert list(rows) == list(stress.CASES)
    copy = tmp_path / "page.md"
    copy.write_text(stress.REPORT.read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.setattr(stress, "REPORT", copy)
    fill(copy, "figures", markdown(stress.HEADER, list(rows.values()), left=2))
    assert stress.reported() == rows


def test_words_that_no_row_holds_are_refused_with_the_rows() -> None:
    with pytest.raises(UserError, match=r"no row holds 'bllur'; there are .*blur, px 2\.5"):
        stress.main(rows="bllur")
