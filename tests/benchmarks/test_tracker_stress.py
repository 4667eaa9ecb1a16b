"""The table of films under stress can be made in parts."""

from pathlib import Path

import pytest

from benchmarks import tracker_stress
from geometry.errors import UserError


def test_rows_that_are_not_made_anew_stay_in_the_report() -> None:
    text = Path(tracker_stress.REPORT).read_text(encoding="utf-8")
    rows = tracker_stress.reported(text)
    assert list(rows) == list(tracker_stress.CASES)
    again = tracker_stress.reported(tracker_stress._report(list(rows.values())))
    assert again == rows


def test_words_that_no_row_holds_are_refused_with_the_rows() -> None:
    with pytest.raises(UserError, match=r"no row holds 'bllur'; there are .*blur, px 2\.5"):
        tracker_stress.main(rows="bllur")
