"""Numbers and anchors of the manoeuvres of a report, over all its logs."""

from dataclasses import dataclass

from analysis.manoeuvres.sailed_manoeuvre import SailedManoeuvre

from .trial_report import TrialReport


@dataclass(frozen=True, eq=False)
class ManoeuvrePlace:
    """A manoeuvre, and where it stands in the report.

    Attributes
    ----------
    manoeuvre
        The manoeuvre.
    position
        Its number in the report, from 1.
    log_number
        The number of its log, from 1.
    """

    manoeuvre: SailedManoeuvre
    position: int
    log_number: int

    @property
    def number(self) -> int:
        """Its number in its own log."""
        return self.manoeuvre.number

    @property
    def anchor(self) -> str:
        """The id of its section."""
        return f"manoeuvre-{self.position}"

    @property
    def title(self) -> str:
        """Its number and what was sailed."""
        return f"{self.position}. {self.manoeuvre.title[:1].upper()}{self.manoeuvre.title[1:]}"


def manoeuvre_places(report: TrialReport) -> tuple[tuple[ManoeuvrePlace, ...], ...]:
    """Number the manoeuvres of each log, through all logs."""
    places, position = [], 0
    for log_number, log in enumerate(report.logs, start=1):
        of_log = []
        for manoeuvre in log.trial.manoeuvres:
            position += 1
            of_log.append(ManoeuvrePlace(manoeuvre, position, log_number))
        places.append(tuple(of_log))
    return tuple(places)
