"""The study's service as the terminal sees it: where its pages are, and how the session goes."""

import math
import os
import webbrowser
from pathlib import Path

import msgspec

from services.jobs.play.page import has_browser
from services.jobs.play.plan import Plan
from services.jobs.play.screen import Screen
from services.supervisor import ProcessSpec, service_command
from shared.bus.base import Bus, Subscription
from shared.clock import Clock, SystemClock
from shared.messages.live import ServiceStatus
from shared.messages.topics import STATUS

FILE = "study.json"
LINGER_SECONDS = 5.0
"""From the end of a session to that of its processes: the pages still show the thanks."""


class _Place(msgspec.Struct):
    researcher: str
    participant: str
    pid: int


class StudyHost:
    """Leads a match in the place of `riposte play`."""

    def __init__(
        self, plan: Plan, title: str, participant: str, *, browser: bool = False,
        clock: Clock | None = None,
    ) -> None:  # fmt: skip
        """Prepare.

        Args:
            plan: the match.
            title: of the study.
            participant: whose session it is.
            browser: whether to open the researcher's page.
            clock: times the end; the machine's where none is given.
        """
        self.title = f"study: {title}, {participant}"
        self._plan = plan
        self._browser = browser
        self._clock = clock or SystemClock()
        self._statuses: Subscription[ServiceStatus] | None = None
        self._over_at = math.inf
        self._step = ""

    @property
    def is_over(self) -> bool:
        """Return whether the session has been over for a while."""
        return self._clock.now() - self._over_at > LINGER_SECONDS

    def processes(self, made: list[ProcessSpec], endpoint: str) -> list[ProcessSpec]:
        """Return what to start: the study's service too, and the page of a mouse only."""
        plan = self._plan
        if plan.antagonist.label != "mouse":
            made = [spec for spec in made if not spec.name.startswith("page")]
        command = service_command(
            "study", name="study-0", run=plan.folder, site=plan.folder / "config.toml",
            run_id=plan.run, connect=(endpoint,),
        )  # fmt: skip
        return [*made, ProcessSpec("study-0", command, finishes=False)]

    def listen(self, bus: Bus) -> None:
        """Begin to listen to the study's service."""
        self._statuses = bus.subscribe(STATUS, role="study")

    def tick(self, screen: Screen) -> None:
        """Show where the pages are and how the session goes."""
        if "researcher" not in screen.places and (place := read_place(self._plan.folder)):
            screen.places.update(researcher=place.researcher, participant=place.participant)
            screen.say(f"researcher: {place.researcher}")
            screen.say(f"participant: {place.participant}")
            if self._browser and has_browser():
                webbrowser.open(place.researcher)
        assert self._statuses is not None, "listen comes first"
        while (status := self._statuses.take()) is not None:
            waits = f"waits for {status.waiting_for}" if status.waiting_for else ""
            screen.notes = tuple(note for note in (status.state, waits) if note)
            if status.counters.get("is_over") and math.isinf(self._over_at):
                self._over_at = self._clock.now()
                screen.say("the session is over")


def read_place(folder: Path) -> _Place | None:
    """Return where the pages of the session in a folder are; None while there are none."""
    try:
        place = msgspec.json.decode((folder / FILE).read_bytes(), type=_Place)
        os.kill(place.pid, 0)
    except (OSError, ValueError, RecursionError, OverflowError):
        return None
    return place
