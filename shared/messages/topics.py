"""The one topic table: every key on the bus, what it carries and how."""

import dataclasses
import enum
from typing import Any, Generic, Literal, TypeVar, get_args

from shared.messages.league import (
    BoutResults,
    Incident,
    Lease,
    LeaseRenewal,
    LeaseRequest,
    Leases,
    LeaseStatus,
    RunSettings,
    Schedule,
    SettingsRequest,
    SnapshotReply,
    SnapshotRequest,
)
from shared.messages.live import BoutFrames, Progress, ServiceStatus
from shared.messages.message import Message
from shared.messages.play import (
    ArmStates,
    BatStates,
    DesiredOffset,
    GateReply,
    GateRequest,
    GateState,
    HeartRate,
    PlayerReply,
    PlayerRequest,
    PlayReply,
    PlayRequest,
    RefereeState,
    TrackerPose,
)
from shared.messages.robot import RobotReport
from shared.messages.tracking import TrackerRaw
from shared.messages.training import (
    PolicyAnnouncement,
    Receipt,
    Rollout,
    VersionReceipt,
    VersionReport,
)

Role = Literal[
    "league", "learner", "actor", "recorder", "referee", "policy", "robot_io", "page", "study",
    "metrics", "operator",
]  # fmt: skip
"""Who speaks on the bus; ``operator`` is what a person's commands are."""
ROLES: tuple[Role, ...] = get_args(Role)
SERVICE_ROLES: tuple[Role, ...] = tuple(role for role in ROLES if role != "operator")
_SEEN_BY: dict[Role, tuple[Role, ...]] = {
    "referee": ("policy", "page", "study"), "policy": ("page", "study"), "robot_io": ("study",),
    "recorder": ("study",),
}  # fmt: skip
WATCHERS: dict[Role, tuple[Role, ...]] = {
    role: (*_SEEN_BY.get(role, ()), "operator") for role in SERVICE_ROLES
}
"""Who may know which processes of a role are alive."""
CERTIFIED: tuple[str, ...] = ("router", *ROLES)
"""Common names of a site's certificates; the router carries what others say."""

M = TypeVar("M", bound=Message)
R = TypeVar("R", bound=Message)


def key_role(role: Role) -> str:
    """Return a role as keys have it."""
    return role.replace("_", "-")


class Qos(enum.Enum):
    """How a topic travels."""

    LATEST = "latest"
    """Newest value wins; re-sent every second, so that late joiners and healed links get it."""
    STREAM = "stream"
    """Every value once, dropped where a reader is slow; for viewers."""
    REQUEST = "request"
    """Asked and answered; the asker decides what to do without an answer."""


@dataclasses.dataclass(frozen=True)
class Topic(Generic[M]):
    """A published value."""

    key: str
    """Key expression with ``{fields}``."""
    message: type[M]
    qos: Qos
    max_bytes: int
    """Payloads over this are refused unread."""
    writers: tuple[Role, ...]
    """Where the key has a ``{role}`` it is the writer's own."""
    readers: tuple[Role, ...]
    about: str


@dataclasses.dataclass(frozen=True)
class Service(Generic[M, R]):
    """A request and its answer; ``acked`` ones are repeated until answered and applied once."""

    key: str
    request: type[M]
    reply: type[R]
    max_bytes: int
    max_reply_bytes: int
    askers: tuple[Role, ...]
    answerer: Role
    about: str
    acked: bool = False
    qos: Qos = Qos.REQUEST


KIB = 1024
MIB = 1024 * KIB

# fmt: off
ROLLOUT = Service(
    "learner/{agent}/rollout", Rollout, Receipt, 8 * MIB, 4 * KIB, ("actor",), "learner",
    "T x N steps; acknowledged when a checkpoint holds the update made from them", acked=True,
)
RESULTS = Service(
    "league/results", BoutResults, Receipt, 1 * MIB, 4 * KIB, ("actor",), "league",
    "finished bouts, those of one pair of players together; "
    "acknowledged when they are in the ledger", acked=True,
)
VERSION = Service(
    "league/version", VersionReport, VersionReceipt, 8 * MIB, 1 * MIB, ("learner",), "league",
    "a new policy version; acknowledged when ledger and snapshot store hold it", acked=True,
)
INCIDENT = Service(
    "league/incident", Incident, Receipt, 16 * KIB, 4 * KIB, ("learner", "operator"), "league",
    "what the report should mention", acked=True,
)
LEASE = Service(
    "league/lease", LeaseRequest, Lease, 4 * KIB, 16 * KIB, ("actor",), "league", "asks for work"
)
RENEWAL = Service(
    "league/renewal", LeaseRenewal, LeaseStatus, 4 * KIB, 4 * KIB, ("actor",), "league",
    "keeps a lease alive",
)
SNAPSHOT = Service(
    "league/snapshot", SnapshotRequest, SnapshotReply, 4 * KIB, 8 * MIB, ("actor",), "league",
    "fetches an immutable policy by its hash",
)
SETTINGS = Service(
    "league/settings", SettingsRequest, RunSettings, 4 * KIB, 1 * MIB, ("actor",), "league",
    "what an actor that joins from elsewhere must play by",
)
POLICY = Topic(
    "learner/{agent}/policy", PolicyAnnouncement, Qos.LATEST, 8 * MIB, ("learner",), ("actor",),
    "the version to act with",
)
SCHEDULE = Topic(
    "league/schedule", Schedule, Qos.LATEST, 64 * KIB, ("league",),
    ("actor", "learner", "recorder", "operator"), "stage and versions",
)
LEASES = Topic(
    "league/leases", Leases, Qos.LATEST, 8 * MIB, ("league",), ("learner", "operator"),
    "whose rollouts may be learned from",
)
PROGRESS = Topic(
    "league/progress", Progress, Qos.LATEST, 64 * KIB, ("league",),
    ("recorder", "metrics", "operator"), "where the run stands",
)
STATUS = Topic(
    "status/{role}/{name}", ServiceStatus, Qos.LATEST, 64 * KIB, SERVICE_ROLES,
    ("recorder", "page", "study", "metrics", "operator"),
    "health, rates, and whom a service waits for",
)
FRAMES = Topic(
    "actor/{name}/frames", BoutFrames, Qos.STREAM, 8 * MIB, ("actor",), ("recorder",),
    "a sampled bout to look at",
)
BATS = Topic(
    "play/bats", BatStates, Qos.STREAM, 4 * KIB, ("robot_io",),
    ("policy", "referee", "page", "study", "recorder", "operator"), "both bats, 100 a second",
)
ARMS = Topic(
    "play/arms", ArmStates, Qos.STREAM, 4 * KIB, ("robot_io",), ("page", "recorder"),
    "joints of the robots that play",
)
ROBOT = Topic(
    "play/robot", RobotReport, Qos.STREAM, 4 * KIB, ("robot_io",), ("recorder",),
    "forces, efforts and troubles of the robot",
)
TRACKER = Topic(
    "play/tracker", TrackerPose, Qos.STREAM, 4 * KIB, ("page",), ("robot_io", "recorder"),
    "a person's bat, from a page",
)
TRACKER_RAW = Topic(
    "play/tracker_raw", TrackerRaw, Qos.STREAM, 4 * KIB, ("robot_io",), ("recorder", "operator"),
    "a Vive tracker in the base stations' frame",
)
OFFSET = Topic(
    "play/{agent}/offset", DesiredOffset, Qos.STREAM, 4 * KIB, ("policy", "operator"),
    ("robot_io", "recorder", "operator"), "where the tool should go from here",
)
REFEREE = Topic(
    "play/referee", RefereeState, Qos.LATEST, 4 * KIB, ("referee",),
    ("robot_io", "policy", "page", "study", "recorder", "operator"),
    "phase, score and tone of the bout",
)
GATE = Topic(
    "play/gate", GateState, Qos.LATEST, 4 * KIB, ("robot_io",),
    ("page", "study", "recorder", "operator"), "mode of the safety gate and what it sent",
)
HEART_RATE = Topic(
    "play/heart_rate", HeartRate, Qos.STREAM, 4 * KIB, ("robot_io",), ("recorder", "page", "study"),
    "of the person who plays",
)
BOUT = Service(
    "play/bout", PlayRequest, PlayReply, 4 * KIB, 4 * KIB, ("page", "study", "operator"),
    "referee", "starts, pauses and ends a bout",
)
PLAYER = Service(
    "play/{agent}/player", PlayerRequest, PlayerReply, 4 * KIB, 4 * KIB, ("page", "study"),
    "policy", "who plays a side from the next bout on",
)
ARM = Service(
    "play/arm", GateRequest, GateReply, 4 * KIB, 16 * KIB, ("page", "study", "operator"),
    "robot_io", "a person arms or disarms the robot",
)

# fmt: on

SERVICES: tuple[Service[Any, Any], ...] = (
    ROLLOUT,
    RESULTS,
    VERSION,
    INCIDENT,
    LEASE,
    RENEWAL,
    SNAPSHOT,
    SETTINGS,
    BOUT,
    PLAYER,
    ARM,
)
TOPICS: tuple[Topic[Any], ...] = (
    POLICY, SCHEDULE, LEASES, PROGRESS, STATUS, FRAMES, BATS, ARMS, ROBOT, TRACKER, TRACKER_RAW,
    OFFSET, REFEREE, GATE, HEART_RATE,
)  # fmt: skip
