"""Predicts the samples a second of a run, and what holds it back, from measured coefficients.

Everything a run needs is a load on something that has a capacity: CPU seconds a second on a
thread, a process or a machine, bytes a second on a link. A load has a part that is there whatever
is learned (sessions, leases, values sent again every second) and a part for each sample. So the
rate is the smallest of (capacity - standing load) / (load of a sample), and the resource that gives
it is the bottleneck. Pure functions; nothing here is measured.
"""

import dataclasses
import math

import msgspec

RESENDS = 1.0
"""A second; LATEST values are sent again so often (``bus.resend_seconds``)."""
LEARNERS = 2
"""One an agent; both hear whose rollouts may be learned from."""
RENEWALS = 3.0
"""Renewals of a lease within its time."""


class Coefficients(msgspec.Struct, frozen=True, kw_only=True):
    """What one unit of work costs: CPU seconds and bytes.

    Each is a property of the code and of one kind of core; ``python -m benchmarks.scale`` measures
    them.
    """

    actor_s: float
    """CPU seconds of an actor for a sample: physics, two policies, judging, encoding."""
    rollout_bytes: float
    """Bytes of a sample on the wire."""
    learner_s: float
    """Of the learner, a second, when it has nothing to do."""
    ingest_s: float
    """Of the learner's main thread for a sample: decoding, checking, holding."""
    ingest_rollout_s: float
    """The same for a rollout, whatever its size, its answer included."""
    ingest_threads_s: float
    """Of the learner's other threads for a sample: the bus."""
    update_s: float
    """Of the learner's main thread for a sample: PPO."""
    version_s: float
    """Of the learner for a version: checkpoint, snapshot, report."""
    router_s: float
    """Of the router, a second, when nothing is carried."""
    router_byte_s: float
    """Of the router for a byte of a rollout, in and out."""
    router_rollout_s: float
    """The same for a rollout, whatever its size, and its answer."""
    router_fan_out_byte_s: float
    """Of the router for a byte delivered of a value that the league or a learner publishes."""
    router_actor_s: float
    """Of the router for an actor, a second: keep-alives, renewals, status."""
    league_s: float
    """Of the league, a second, when nobody asks."""
    league_actor_s: float
    """Of the league for an actor, a second: its renewals."""
    league_pair_s: float
    """Of the league for an actor and a second, times the actors: what its answers look through."""
    league_version_s: float
    """Of the league for a version: checks, commit, snapshot."""
    league_version_actor_s: float
    """The same for each actor in it: the list of leases is looked through."""
    schedule_bytes: float
    """Of the schedule, which every actor hears."""
    lease_bytes: float
    """Of a lease in the list that the learners hear."""
    policy_bytes: float
    """Of an announced policy."""
    router_bytes_per_actor: float
    """Resident memory of the router for each actor."""
    league_bytes_per_actor: float
    """Resident memory of the league for each actor."""
    learner_bytes_per_actor: float
    """Resident memory of a learner for each actor, held rollouts aside."""

    def slowed(self, factor: float) -> "Coefficients":
        """Return what they are where everything takes so many times the CPU seconds."""
        times = [name for name in self.__struct_fields__ if name.endswith("_s")]
        return msgspec.structs.replace(
            self, **{name: factor * getattr(self, name) for name in times}
        )


@dataclasses.dataclass(frozen=True)
class Job:
    """What is trained, as far as it matters here; the defaults are a run's defaults."""

    num_envs: int = 128
    rollout_steps: int = 40
    batch_samples: int = 20480
    max_lag: int = 1
    lease_seconds: float = 10.0
    does_update: bool = True
    """False: a learner that gathers and commits and leaves PPO out."""

    @property
    def rollout_samples(self) -> int:
        """Return the samples of one rollout."""
        return self.num_envs * self.rollout_steps

    def for_actors(self, actors: int) -> "Job":
        """Return the job with a batch that has room for a rollout of every actor.

        A rollout may be ``max_lag`` versions old, so what all actors have under way must fit into
        that many batches and one more; a batch is never smaller than the job's.
        """
        least = math.ceil(actors / (1 + self.max_lag)) * self.rollout_samples
        return dataclasses.replace(self, batch_samples=max(self.batch_samples, least))


@dataclasses.dataclass(frozen=True)
class Site:
    """Where it runs: a central machine with router, league and learners, and the actors."""

    cores: float = 2.0
    """Of the central machine."""
    actor_cores: float | None = None
    """Of all the actors' machines; None: the actors share the central machine."""
    link: float = math.inf
    """Bytes a second of the central machine's link, each way; actors that share it use none."""
    router_cores: float = 2.0
    """What one router can keep busy; measured up to two, so more is not assumed."""
    learners: int = 1
    """Processes that share one agent's rollouts and updates."""
    relays: int = 0
    """Routers between the actors and the central one, each for an equal part; 0: none."""


@dataclasses.dataclass(frozen=True)
class Load:
    """One resource: what it has, what stands on it, and what each sample adds."""

    name: str
    capacity: float
    """In CPU seconds a second, or bytes a second."""
    standing: float
    per_sample: float

    @property
    def samples_per_s(self) -> float:
        """Return the rate at which it is full; 0 when what stands on it fills it already."""
        free = self.capacity - self.standing
        if free <= 0.0:
            return 0.0
        return free / self.per_sample if self.per_sample > 0.0 else math.inf

    def use(self, samples_per_s: float) -> float:
        """Return how much of it is used at a rate, in its own unit."""
        return self.standing + self.per_sample * samples_per_s


@dataclasses.dataclass(frozen=True)
class Prediction:
    """What a site does with so many actors."""

    actors: int
    samples_per_s: float
    bottleneck: str
    loads: tuple[Load, ...]

    def use(self, name: str) -> float:
        """Return how much of a resource is used at the predicted rate, in its own unit."""
        return self.load(name).use(self.samples_per_s)

    def load(self, name: str) -> Load:
        """Return the load on a resource by its name."""
        return next(load for load in self.loads if load.name == name)


def router(found: Coefficients, site: Site, job: Job, actors: int) -> tuple[float, float]:
    """Return the central router's CPU seconds: a second, and a sample."""
    fan_out, fan_out_sample = broadcast(found, site, job, actors)
    fan_out += LEARNERS * RESENDS * found.lease_bytes * actors
    sessions = actors if not site.relays else site.relays
    return (
        found.router_s + found.router_actor_s * sessions + found.router_fan_out_byte_s * fan_out,
        found.router_byte_s * found.rollout_bytes
        + found.router_rollout_s / job.rollout_samples
        + found.router_fan_out_byte_s * fan_out_sample,
    )


def broadcast(found: Coefficients, site: Site, job: Job, actors: int) -> tuple[float, float]:
    """Return the bytes that the central router sends to all actors: a second, and a sample.

    Every second the schedule and both agents' policies go out again; a version changes the schedule
    and the policy of one agent.
    """
    ends = site.relays or actors
    versions = 1.0 / job.batch_samples
    return (
        ends * RESENDS * (found.schedule_bytes + 2.0 * found.policy_bytes),
        ends * versions * (found.schedule_bytes + found.policy_bytes),
    )


def league(found: Coefficients, job: Job, actors: int) -> tuple[float, float]:
    """Return the league's CPU seconds: a second, and a sample."""
    renewals = RENEWALS / job.lease_seconds
    at_default = RENEWALS / Job().lease_seconds
    asked = actors * (found.league_actor_s + found.league_pair_s * actors)
    return (
        found.league_s + asked * renewals / at_default,
        (found.league_version_s + found.league_version_actor_s * actors) / job.batch_samples,
    )


def learner_thread(found: Coefficients, job: Job) -> float:
    """Return the CPU seconds of the learner's main thread for a sample."""
    update = found.update_s if job.does_update else 0.0
    ingest = found.ingest_s + found.ingest_rollout_s / job.rollout_samples
    return ingest + update + found.version_s / job.batch_samples


def loads(found: Coefficients, site: Site, job: Job, actors: int) -> tuple[Load, ...]:
    """Return the load on every resource of a site with so many actors."""
    router_standing, router_sample = router(found, site, job, actors)
    league_standing, league_sample = league(found, job, actors)
    thread = learner_thread(found, job)
    central = thread + found.ingest_threads_s + router_sample + league_sample
    standing = router_standing + league_standing + found.learner_s * site.learners
    out, out_sample = broadcast(found, site, job, actors)
    shared = site.actor_cores is None
    cores = min(float(actors), site.cores if site.actor_cores is None else site.actor_cores)
    made = [
        Load("actors", cores, 0.0, found.actor_s),
        Load("learner's thread", float(site.learners), found.learner_s * site.learners, thread),
        Load("router", site.router_cores, router_standing, router_sample),
        Load("league's thread", 1.0, league_standing, league_sample),
        Load(
            "central machine's cores", site.cores, standing,
            central + (found.actor_s if shared else 0.0),
        ),
    ]  # fmt: skip
    if not shared:
        made += [
            Load("link, in", site.link, 0.0, found.rollout_bytes),
            Load("link, out", site.link, out, out_sample),
        ]
    return tuple(made)


def predict(found: Coefficients, site: Site, job: Job, actors: int) -> Prediction:
    """Return the samples a second of a site with so many actors, and what holds it back.

    Raises:
        ValueError: fewer than one actor.
    """
    if actors < 1:
        raise ValueError(f"actors ({actors}) must be at least 1")
    made = loads(found, site, job, actors)
    least = min(made, key=lambda load: load.samples_per_s)
    return Prediction(actors, least.samples_per_s, least.name, made)


def actors_at_limit(found: Coefficients, site: Site, job: Job, name: str) -> int:
    """Return the largest number of actors that still leaves a resource room at its peak.

    It is where what stands on the resource, whatever is learned, fills half of it. Between 1 and
    one million.
    """
    low, high = 1, 1_000_000
    while low < high:
        middle = (low + high + 1) // 2
        load = next(one for one in loads(found, site, job, middle) if one.name == name)
        if load.standing <= 0.5 * load.capacity:
            low = middle
        else:
            high = middle - 1
    return low
