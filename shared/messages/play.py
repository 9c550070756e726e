"""What referee, policy and robot_io say to each other in a live bout."""

from typing import Annotated, Literal

from shared.messages.message import Array, ArraySpec, Message
from shared.messages.training import Agent

Phase = Literal["ready", "running", "paused", "finished", "void"]
GateMode = Literal["disarmed", "ramping", "armed", "holding", "tripped"]


class BatStates(Message, frozen=True, kw_only=True):
    """Both bats and tools at one tick of the 100 Hz loop."""

    tick: int
    """Counts the ticks of one boot of robot_io from 0; a gap is a lost tick."""
    boot: str
    at_ns: int
    """Wall clock at which the states held."""
    bats: Annotated[Array, ArraySpec("float64", (2, 13))]
    """Antagonist first, world frame: position (m), orientation (w x y z), linear (m/s) and angular
    velocity (rad/s)."""
    tools: Annotated[Array, ArraySpec("float64", (2, 7))]
    """Antagonist first: position (m) and orientation (w x y z) of the tool in its agent's torso
    frame; zeros for a side that no robot plays."""
    is_valid: Annotated[Array, ArraySpec("bool", (2,))]
    """Whether each bat is tracked; a state that is not is the last that was."""
    seconds: float
    """Game time of the running bout (s); 0 outside one."""
    tracker_source: str = ""
    """Of the newest ``TrackerPose`` in the antagonist's state; empty where none is."""
    tracker_sequence: int = -1
    """Of the same pose: whoever sent it learns when it was acted on."""


class ArmStates(Message, frozen=True, kw_only=True):
    """The joints of both arms at one tick, to draw and to record."""

    tick: int
    """Of the bat states published with it."""
    boot: str
    is_there: Annotated[Array, ArraySpec("bool", (2,))]
    """Whether a robot plays the side, antagonist first."""
    positions: Annotated[Array, ArraySpec("float64", (2, 7))]
    """From the shoulder to the wrist (rad); zeros for a side that no robot plays."""
    velocities: Annotated[Array, ArraySpec("float64", (2, 7))]
    """The same (rad/s)."""


class TrackerPose(Message, frozen=True, kw_only=True):
    """Where a person's bat is, from a source outside robot_io: the mouse of a browser."""

    sequence: int
    """Counts the poses of one source from 0."""
    source: str
    """Identity of the page or program that sends; a new one is a new tracker."""
    pose: Annotated[Array, ArraySpec("float64", (7,))]
    """Bat frame in the world: position (m), orientation (w x y z), +x along the blade."""
    is_valid: bool = True
    """False while the source knows that it has lost the bat."""


class DesiredOffset(Message, frozen=True, kw_only=True):
    """A policy's answer to one tick."""

    agent: Agent
    """The side it plays."""
    tick: int
    """Of the bat states it answers."""
    boot: str
    """Of the robot_io that published them."""
    snapshot: str
    """Player reference."""
    offset: Annotated[Array, ArraySpec("float64", (6,))]
    """Bounded offset of the tool: translation (m), rotation (axis times 2 tan(angle / 2))."""
    took_ms: float
    """From the arrival of the states to this answer."""


class PlayRequest(Message, frozen=True, kw_only=True):
    """Asks the referee for the next step in the course of a bout."""

    action: Literal["start", "pause", "resume", "abandon"]
    bout: str
    """Name of the bout; a new one for each start."""
    antagonist: str = ""
    protagonist: str = ""
    """Player references, or ``person`` (start)."""
    reason: str = ""
    seconds: float = 0.0
    """How long the bout is (start; s); 0 is as the rule book says."""
    speed: float = 1.0
    """Share of its speed in a bout that the robot's tool may have (start); 0 keeps it still."""
    is_recorded: bool = True
    """Whether the recorder archives the bout (start)."""


class PlayReply(Message, frozen=True, kw_only=True):
    """Whether it happened, and why not."""

    accepted: bool
    phase: Phase
    reason: str = ""


class PlayerRequest(Message, frozen=True, kw_only=True):
    """Asks a policy to play as another player; only between bouts."""

    player: str
    """``scripted:NAME``, the file of a snapshot, ``RUN:AGENT`` or ``sha256:HASH``."""


class PlayerReply(Message, frozen=True, kw_only=True):
    """Whether the change happened, and why not."""

    accepted: bool
    player: str
    """Who plays now: ``scripted:NAME`` or ``sha256:HASH``."""
    reason: str = ""


class RefereeState(Message, frozen=True, kw_only=True):
    """Where the bout stands; every tick while one runs."""

    bout: str
    """Empty before the first."""
    phase: Phase
    reason: str = ""
    """Why it is paused or void."""
    antagonist: str
    protagonist: str
    tick: int
    """Of the bat states that were judged last, or after which the bout was started or resumed."""
    step: int
    """Steps judged."""
    seconds: float
    """Game time (s)."""
    score: float
    """The antagonist's."""
    points: float
    """Of the last step."""
    in_target: Annotated[Array, ArraySpec("bool", (2,))]
    contact: bool
    attack_steps: int
    penalty_steps: int
    camping_steps: int
    missed_ticks: int
    """Ticks that never arrived, judged as the one before."""
    tone_hz: float
    """440 while scoring, 300 on a penalty, 0 for silence."""
    speed: float = 1.0
    """Share of its speed that the robot's tool may have in this bout; 0 keeps it still."""
    is_recorded: bool = True
    """Whether the recorder archives the bout."""


class GateRequest(Message, frozen=True, kw_only=True):
    """A person asks robot_io to arm or disarm; nothing else may. ``check`` changes nothing."""

    action: Literal["arm", "disarm", "reset", "check"]
    operator: str
    """Who asks, for the record."""


class GateReply(Message, frozen=True, kw_only=True):
    """Whether it was done; if not, everything that stands in the way."""

    accepted: bool
    mode: GateMode
    reasons: tuple[str, ...] = ()
    passed: tuple[str, ...] = ()
    """What must be so before arming, and is (check)."""


class GateState(Message, frozen=True, kw_only=True):
    """What the safety gate does, every tick."""

    tick: int
    mode: GateMode
    reason: str = ""
    """Why it holds or has tripped."""
    commanded: Annotated[Array, ArraySpec("float64", (7,))]
    """Pose sent to the robot: position (m), orientation (w x y z), torso frame."""
    is_clipped: bool
    """The command asked for more than the limits allow."""
    is_sent: bool = False
    """Whether ``commanded`` went to the robot in this tick."""
    lateness_ms: float
    """Of this tick of the loop."""
    answer_ms: float | None = None
    """From this tick's states being read to the policy's command being sent, where it was."""
    answered_tick: int | None = None
    """Tick whose states that command answers: this one, or the one before of a slow policy."""
    late_ticks: int
    """Ticks more than one period late, since the start."""


class HeartRate(Message, frozen=True, kw_only=True):
    """One measurement of the strap."""

    at_ns: int
    beats_per_minute: float
    rr_ms: tuple[float, ...] = ()
    """Intervals between beats, where the strap gives them (ms)."""
    contact: bool = True
    source: str
