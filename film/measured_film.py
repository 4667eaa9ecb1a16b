"""A film as the source of the markers of a comparison."""

from pathlib import Path

from pinnray.comparison.pipeline.job import Measured
from pinnray.film.film import Film
from pinnray.film.predicted_frame import predicted_frame
from pinnray.film.track_film import track_figures, track_film
from pinnray.geometry.finger.finger import Finger
from pinnray.runtime.stages import Stages


class MeasuredFilm(Film):
    """A film that is tracked when a comparison begins; see `comparison.pipeline.job.MarkerSource`."""

    def measured(self, design: Finger, folder: Path, stages: Stages) -> Measured:
        """Track the film into the folder `track`; solutions are drawn into a frame of the pressed finger.

        Raises:
            UserError: If the film cannot be read or tracked.
        """
        track = folder / "track"
        with stages.stage("track") as progress:
            track.mkdir()
            tracking, observations, pressed = track_film(self, design, track, progress, video=False)
        return Measured(
            observations,
            tracking.warnings,
            track_figures(track, tracking),
            lambda comparison: [predicted_frame(track, comparison, tracking, pressed)],
        )
