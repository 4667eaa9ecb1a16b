"""Fixtures of the tests of films."""

import pytest

from tests.vision.tracking.listed_discs import ListedDiscs


@pytest.fixture
def listed(monkeypatch: pytest.MonkeyPatch) -> ListedDiscs:
    """A detector that reads lists of discs, in place of that of the scene and of the tracker."""
    from pinnray.vision.tracking import frame_tracker, scene

    detector = ListedDiscs()
    monkeypatch.setattr(scene, "detect_discs", detector.detect)
    monkeypatch.setattr(frame_tracker, "detect_discs", detector.detect)
    monkeypatch.setattr(frame_tracker, "detect_discs_near", detector.detect_near)
    return detector
