"""The page's work: bus in, browser out, and the other way round, without waiting for either."""

from collections.abc import Callable
from typing import Protocol

from services.page import frames
from services.page.config import PageConfig
from services.page.course import ASK_SECONDS, OPERATOR, Course, sides_of
from services.page.hearing import Hearing
from services.page.protocol import Ask, BoutAsk, GateAsk, PlayerAsk, Pointer, StatsAsk
from services.page.tracking import PointerTracker
from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.clock import Clock
from shared.messages.play import GateReply, GateRequest
from shared.messages.topics import ARM, TRACKER
from shared.runtime.rate import Rate
from shared.runtime.service import Health

FRAME_PERIOD = 0.1
"""Without bat states, a frame goes out so often (s)."""
PATIENCE, IDLE_PATIENCE = 0.002, 0.05
"""Longest wait for the bus with and without a page, whose messages do not end it (s)."""


class Window(Protocol):
    """The browser's side; ``Web`` is the real one."""

    @property
    def session(self) -> int:
        """Return the number of the page that plays, 0 without one."""
        ...

    @property
    def counters(self) -> dict[str, int]:
        """Return counts since the start."""
        ...

    @property
    def last_refusal(self) -> str:
        """Return why a page or a message was refused last."""
        ...

    def show(self, frame: bytes) -> None:
        """Send the newest frame."""
        ...

    def tell(self, note: bytes) -> None:
        """Send a note, in order."""
        ...

    def take_pointer(self) -> Pointer | None:
        """Return the newest pose not taken yet."""
        ...

    def take_ask(self) -> Ask | None:
        """Return the oldest wish not taken yet."""
        ...

    def close(self) -> None:
        """Send the page away."""
        ...


class Page:
    """One page and one bout; a service that ticks, at the latest after ``patience``."""

    def __init__(
        self, cfg: PageConfig, web: Window, tracker: PointerTracker,
        hello: Callable[[Course], bytes], bus: Bus, clock: Clock,
    ) -> None:  # fmt: skip
        """Join the bus.

        Args:
            cfg: settings.
            web: the browser's side, which serves already.
            tracker: makes poses of the mouse.
            hello: makes what a new page has to know.
            bus: this process's end of the bus.
            clock: a clock that moves by itself, or is moved.
        """
        self._cfg = cfg
        self._web = web
        self._tracker = tracker
        self._hello = hello
        self._bus = bus
        self._clock = clock
        self._heard = Hearing(bus, sides_of(cfg))
        self.course = Course(cfg, bus, self._heard, self._tell)
        self._gate_asked: Pending[GateReply] | None = None
        self._session = 0
        self._shown_at = clock.now()
        self._stats: StatsAsk | None = None
        self._poses = Rate(clock)
        self._asked = {"poses_sent": 0, "gate_asked": 0}

    @property
    def patience(self) -> float:
        """Return how long the service may be left alone (s)."""
        return PATIENCE if self._web.session else IDLE_PATIENCE

    def tick(self) -> bool:
        """Carry what there is in both directions; return whether there was anything."""
        now = self._clock.now()
        did = self._meet()
        did = self._follow_pointer(now) or did
        has_bats = self._heard.listen(now)
        while (ask := self._web.take_ask()) is not None:
            did = True
            self._do(ask, now)
        self._hear_gate()
        if self.course.tick(now):
            self._web.tell(frames.results(self.course))
        if has_bats or now - self._shown_at >= FRAME_PERIOD:
            self._shown_at = now
            self._show(now)
        return did or has_bats

    def _meet(self) -> bool:
        """Greet a page that has just come."""
        if (session := self._web.session) == self._session:
            return False
        self._session = session
        self._stats = None
        self._tracker.lose()
        if session:
            self._web.tell(self._hello(self.course))
            self._web.tell(frames.results(self.course))
        return True

    def _follow_pointer(self, now: float) -> bool:
        if not self._cfg.pointer:
            self._web.take_pointer()
            return False
        if (pointer := self._web.take_pointer()) is not None and pointer.session == self._session:
            self._tracker.hear(pointer, now)
        else:
            pointer = None
        if (pose := self._tracker.due(now, is_fresh=pointer is not None)) is None:
            return False
        self._bus.publish(TRACKER, pose)
        self._poses.add(1)
        self._asked["poses_sent"] += 1
        return True

    def _do(self, ask: Ask, now: float) -> None:
        is_disarm = isinstance(ask, GateAsk) and ask.action == "disarm"
        if self._cfg.is_led and not isinstance(ask, StatsAsk) and not is_disarm:
            self._tell("bout", False, ["a study leads: its researcher does that"])
        elif isinstance(ask, BoutAsk):
            self.course.ask(ask, now)
        elif isinstance(ask, PlayerAsk):
            self.course.choose(ask.name)
            self._web.tell(frames.results(self.course))
        elif isinstance(ask, GateAsk):
            self._ask_gate(ask)
        else:
            self._stats = ask

    def _ask_gate(self, ask: GateAsk) -> None:
        if self._gate_asked is not None:
            self._tell("gate", False, ["robot_io has not answered yet"])
            return
        self._asked["gate_asked"] += 1
        request = GateRequest(action=ask.action, operator=OPERATOR)
        self._gate_asked = self._bus.ask(ARM, request, ASK_SECONDS)

    def _hear_gate(self) -> None:
        if self._gate_asked is None or (reply := self._gate_asked.take()) is None:
            return
        self._gate_asked = None
        if isinstance(reply, Refused | NoAnswer):
            self._tell("gate", False, [reply.reason])
        else:
            self._tell("gate", reply.accepted, list(reply.reasons))

    def _show(self, now: float) -> None:
        if not self._session:
            return
        bats = self._heard.bats
        echo = self._tracker.echo(bats) if bats is not None else -1
        is_lost = self._tracker.is_lost
        self._web.show(frames.frame(self._heard, self.course, echo, is_lost=is_lost, now=now))

    def _tell(self, about: str, is_done: bool, lines: list[str]) -> None:
        self._web.tell(frames.note(about, is_done, lines))

    def health(self) -> Health:
        """Return whether a page plays, what it measures of itself, and what was refused."""
        missing = self._heard.missing(self._clock.now())
        rates = {"poses_per_s": self._poses.per_second()}
        if (stats := self._stats) is not None:
            rates["drawn_per_s"] = stats.frames_per_s
            rates["latency_p50_ms"] = stats.latency_p50_ms
            rates["latency_p90_ms"] = stats.latency_p90_ms
        return Health(
            state=f"{self.course.step}, page open" if self._session else "no page is open",
            waiting_for=", ".join(missing),
            rates=rates,
            counters={**self._asked, **self._web.counters},
            last_error=self._web.last_refusal,
        )

    def close(self) -> None:
        """Let the bat be lost, and send the page away."""
        self._tracker.lose()
        if (pose := self._tracker.due(self._clock.now(), is_fresh=True)) is not None:
            self._bus.publish(TRACKER, pose)
        self._heard.close()
        self._web.close()
