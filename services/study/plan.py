"""What is settled before a session begins: its steps, its players and its names."""

import msgspec

from shared.errors import StudyError
from shared.study.events import SessionBegan, SessionResumed
from shared.study.progress import Progress
from shared.study.protocol import Protocol
from shared.study.steps import Step


class SessionPlan(msgspec.Struct, frozen=True, kw_only=True):
    """One session of one participant."""

    participant: str
    """``sub-01``."""
    session: int
    """From 1."""
    protocol: Protocol
    steps: tuple[Step, ...]
    labels: dict[str, str]
    """Name of a condition -> its blinded label."""
    antagonist: str
    """Reference of who plays against the robot."""
    players: dict[str, str]
    """What the protocol calls a player -> what the policy is told to load; itself where absent."""
    began: SessionBegan
    """The journal's first event."""
    resumed: SessionResumed
    """Its first event of every runner after the first."""

    def label(self, step: Step) -> str:
        """Return the blinded label of a step's condition; empty where it has none."""
        return self.labels.get(step.condition, "")

    def check(self, progress: Progress) -> None:
        """Refuse to go on with a session that is not this plan's.

        Raises:
            StudyError: participant, order or protocol is another one; says which.
        """
        before = progress.began
        assert before is not None, "a journal begins with session_began"
        for what in ("participant", "session", "order", "protocol"):
            was, now = getattr(before, what), getattr(self.began, what)
            if was != now:
                raise StudyError(
                    f"the session of {before.participant} began with {what} {was!r}, and the "
                    f"study's folder now says {now!r}: put back the files it began with"
                )
