"""Many arms at once, each with a model, a command and reports of its own."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Sequence

import mujoco
import mujoco.batch
import numpy as np

from shared.sim.arm import Float64
from shared.sim.model import silence
from shared.sim.plant.centred import centre
from shared.sim.plant.controllers import Controllers
from shared.sim.plant.laws import Active, Rubbing, frictions_of, torques_of
from shared.sim.plant.plant import TOOL, Plant
from shared.sim.plant.replay import Motion, Recorded, Reports, reports_of
from shared.sim.plant.row import Row
from shared.sim.plant.signals import filtered
from shared.sim.plant.step import Moment, Step, rows_of
from shared.sim.plant.structure import Structure, compiled, link_sums

_CHUNK = 250
"""Steps that a batch takes between two looks at what it recorded."""
_STICKS = (0.999, 0.9999)
"""Impedance of dry friction, at least: MuJoCo's 0.9 lets a stuck joint creep 100 times as fast."""


Entry = Callable[[Row], None]
"""Lets base parameters and effects into one arm."""


def _turn_at_once(model: mujoco.MjModel) -> None:
    """Let friction turn round when a joint does, of joints whose file has none.

    MuJoCo's default brings a joint to a stand within 20 ms (solreffriction), so that friction turns
    round some 10 ms before the joint does: at each reversal an arm that nothing holds is given a
    speed that it has not. The least that it can be is two steps.
    """
    model.dof_solref[model.dof_frictionloss == 0.0] = 2.0 * model.opt.timestep, 1.0


def as_it_is(_: Row) -> None:
    """Change nothing of the nominal arm."""


class Rollouts:
    """Arms of one structure, kept compiled."""

    def __init__(self, plant: Plant, structure: Structure, capacity: int, threads: int = 1) -> None:
        """Compile it.

        Args:
            plant: the arm.
            structure: what effects have added to it.
            capacity: the most arms at once.
            threads: that step them; results do not depend on it.
        """
        silence()
        self.plant = plant
        self.capacity = capacity
        self.threads = threads
        self.model = compiled(plant, structure)
        for impedance in (self.model.dof_solimp, self.model.tendon_solimp_fri):
            impedance[:, :2] = np.maximum(impedance[:, :2], _STICKS)
        if plant.control != "pose":
            _turn_at_once(self.model)
        self._joints = [self.model.joint(name) for name in plant.joints]
        self._qpos = np.array([int(joint.qposadr[0]) for joint in self._joints])
        self._dofs = np.array([int(joint.dofadr[0]) for joint in self._joints])
        self._logged, self._moved = rows_of(self._qpos), rows_of(self._dofs)
        self._links = link_sums(plant, self.model) if plant.encoders == "link" else None
        self._columns = np.concatenate(
            [_controls(self.model, int(self.model.actuator(name).id)) for name in plant.actuators]
        )
        self._batch = mujoco.batch.Batch(self.model, nsim=capacity, nthread=threads)
        self._controllers: Controllers | None = None
        self._expanded: dict[str, Float64] = {}
        self._stale: set[str] = set()
        self._needs_constants = False
        self._drive_before = self._speed_before = self._rotors = np.empty(0)
        adr = int(self.model.sensor(f"{TOOL}/position").adr[0])
        self._tool = slice(adr, adr + 7)

    def run(self, work: Sequence[tuple[Entry, Recorded]]) -> list[Reports]:
        """Replay recordings, each on an arm of its own; any number of them.

        Arms that move alike, since they differ in nothing or only in what is reported of them, are
        simulated once.
        """
        rows = [self._entered(entry, recorded) for entry, recorded in work]
        alike: dict[Hashable, list[int]] = defaultdict(list)
        for index, (row, (_, recorded)) in enumerate(zip(rows, work, strict=True)):
            alike[_motion_of(row, recorded)].append(index)
        # A batch goes on until its longest recording ends and asks for torques at each step if one
        # of its arms has a law, so alike ones go together.
        groups = sorted(
            alike.values(),
            key=lambda group: (rows[group[0]].has_laws, float(work[group[0]][1].joints_at[-1])),
        )
        found: dict[int, Reports] = {}
        for begin in range(0, len(groups), self.capacity):
            picked = groups[begin : begin + self.capacity]
            moved = self._run([(rows[group[0]], work[group[0]][1]) for group in picked])
            for group, motion in zip(picked, moved, strict=True):
                for index in group:
                    found[index] = reports_of(rows[index], work[index][1], motion)
        return [found[index] for index in range(len(work))]

    def _run(self, work: Sequence[tuple[Row, Recorded]]) -> list[Motion]:
        rows = [self._commanded(row) for row, _ in work]
        for index, row in enumerate(rows):
            row.index = index
        self._rotors = np.stack([row.current("dof_armature")[self._dofs] for row in rows])
        if self.plant.control == "pose":
            for row in rows:
                centre(row)
        if self._controllers is None and any(row.encoders for row in rows):
            self._controllers = Controllers(self.plant, self.model, self.capacity)
        if self._controllers is not None:
            self._controllers.begin(rows)
        self._restore(rows)
        ids = np.arange(len(rows), dtype=np.int32)
        self._batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE)
        qpos, qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        for row in rows:
            qpos[row.index, self._qpos] = row.initial_q
            qvel[row.index, self._dofs] = row.initial_qd
        if any(row.forces for row in rows):
            forces = self._batch.bind("xfrc_applied")
            for row in rows:
                for body, force in row.forces.items():
                    forces[row.index].reshape(-1, 6)[body, :3] = force
        if any(row.rests for row in rows):
            self._settle(rows)
        timestep = self.plant.timestep
        steps = int(np.ceil(max(row.duration for row in rows) / timestep)) + 1
        wants_tool = any(recorded.tracker_at is not None for _, recorded in work)
        q = np.empty((len(rows), steps + 1, len(self._qpos)))
        tool = np.empty((len(rows), steps + 1, 7)) if wants_tool else None
        q[:, 0] = self._read(qpos[ids])
        laws, frictions = torques_of(rows), frictions_of(rows)
        has_laws = any(row.has_laws for row in rows)
        at: Float64 = timestep * np.arange(steps, dtype=np.float64)
        for begin in range(0, steps, _CHUNK):
            end = min(begin + _CHUNK, steps)
            ctrl = np.zeros((len(rows), end - begin, self.model.nu))
            for row in rows:
                # MuJoCo's Euler step is of second order if the drive is that of half a step
                # before (Stormer and Verlet's method); else every arm would be early by that.
                middle = at[begin:end] - 0.5 * timestep
                ctrl[row.index][:, self._columns] = row.command.mean(middle, timestep)
            found = (
                self._closed(ids, ctrl, laws, frictions, begin)
                if has_laws
                else self._open(ids, ctrl)
            )
            q[:, begin + 1 : end + 1] = found[0]
            if tool is not None:  # sensors say where the tool was before the step
                tool[:, begin:end] = found[1]
        times: Float64 = timestep * np.arange(steps + 1, dtype=np.float64)
        is_bad = self._batch.warning[ids].reshape(len(ids), -1).any(axis=1)
        return [
            Motion(
                times,
                q[row.index],
                None if tool is None else tool[row.index, :-1],
                bool(is_bad[row.index]),
            )
            for row in rows
        ]

    def entered(self, entry: Entry, recorded: Recorded) -> Row:
        """Return an arm with base parameters and effects in it, for those who look what changed."""
        return self._commanded(self._entered(entry, recorded))

    def _entered(self, entry: Entry, recorded: Recorded) -> Row:
        last = float(recorded.joints_at[-1])
        if recorded.tracker_at is not None:
            last = max(last, float(recorded.tracker_at[-1]))
        row = Row(
            plant=self.plant,
            model=self.model,
            index=0,
            dofs=self._dofs,
            command=recorded.command,
            logged_q=recorded.logged_q,
            logged_tracker=recorded.logged_tracker,
            duration=last,
            trajectory=recorded.trajectory,
            begin=recorded.begin,
            earlier=recorded.earlier,
            initial_q=recorded.initial_q,
            initial_qd=recorded.initial_qd,
        )
        entry(row)
        return row

    def _commanded(self, row: Row) -> Row:
        """Return an arm whose command is what reaches its servos."""
        known = self.plant.command
        if not known.is_direct:
            row.command = filtered(row.command.later(known.delay), known.filter, row.duration)
        return row

    def _restore(self, rows: Sequence[Row]) -> None:
        """Give every arm its own model, and the nominal one where it asked for nothing."""
        wanted = {name for row in rows for name in row.fields}
        for name in wanted - self._expanded.keys():
            self._expanded[name] = self._batch.expand(name)
        for name in wanted | self._stale:
            values = self._expanded[name]
            owner = self.model.opt if name.startswith("opt.") else self.model
            values[:] = getattr(owner, name.removeprefix("opt."))
            for row in rows:
                if name in row.fields:
                    values[row.index] = row.fields[name].reshape(values[row.index].shape)
        self._stale = wanted
        needs = bool(wanted & _CONSTANTS)
        if needs or self._needs_constants:
            self._batch.set_const(np.arange(len(rows) if needs else self.capacity))
        self._needs_constants = needs

    def _read(self, qpos: Float64) -> Float64:
        """Return float64[..., J], what right encoders say in a state: float64[..., Q]."""
        return qpos[..., self._logged] if self._links is None else qpos @ self._links

    def _settle(self, rows: Sequence[Row]) -> None:
        """Put added joints where their loads leave them; twice, as that changes the loads.

        Where encoders see the link, the motor is what starts elsewhere than the log says.
        """
        qpos, bias = self._batch.bind("qpos"), self._batch.bind("qfrc_bias")
        for _ in range(2):
            self._batch.forward(np.arange(len(rows)), stage=mujoco.mjtStage.mjSTAGE_VEL)
            for row in rows:
                for name, rests in row.rests.items():
                    joint = self.model.joint(name)
                    load = float(bias[row.index, joint.dofadr[0]])
                    qpos[row.index, joint.qposadr[0]] = rests(load)
                if self._links is not None:
                    qpos[row.index, self._qpos] += row.initial_q - qpos[row.index] @ self._links
        qvel = self._batch.bind("qvel")
        for row in rows:
            for name, speed in row.speeds.items():
                qvel[row.index, self.model.joint(name).dofadr[0]] = speed
            if self._links is not None:
                qvel[row.index, self._dofs] += row.initial_qd - qvel[row.index] @ self._links

    def _open(self, ids: np.ndarray, ctrl: Float64) -> tuple[Float64, Float64]:
        found = self._batch.rollout(
            ctrl.shape[1], control=ctrl, record=("qpos", "sensordata"), ids=ids
        )
        return self._read(found["qpos"]), found["sensordata"][:, :, self._tool]

    def _closed(
        self,
        ids: np.ndarray,
        ctrl: Float64,
        laws: list[Active],
        frictions: list[Rubbing],
        begin: int,
    ) -> tuple[Float64, Float64]:
        batch, arms = self._batch, slice(0, len(ids))
        qpos, qvel, control = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
        applied, drives = batch.bind("qfrc_applied"), batch.bind("qfrc_actuator")
        bias, sensors = batch.bind("qfrc_bias"), batch.bind("sensordata")
        logged, moved = self._logged, self._moved
        count = ctrl.shape[1]
        q = np.empty((len(ids), count, len(self._qpos)))
        tool = np.empty((len(ids), count, 7))
        rubs = self._expanded["dof_frictionloss"] if frictions else np.empty((0, 0))
        rubbed = np.array(rubs[arms, moved]) if frictions else rubs
        has_bristles = any(each.bristles is not None for each in frictions)
        damps = self._expanded["dof_damping"] if has_bristles else rubs
        damped = np.array(damps[arms, moved]) if has_bristles else rubs
        beside = self._controllers
        if beside is not None and not len(beside.rows):
            beside = None
        its = rows_of([] if beside is None else beside.rows)
        if begin == 0:  # what the drives do and hold before the first step
            control[arms] = ctrl[:, 0]
            batch.forward(ids)
            self._drive_before = np.array(drives[arms, moved])
            self._speed_before = np.array(qvel[arms, moved])
        for index in range(count):
            control[arms] = ctrl[:, index]
            added = np.zeros_like(self._drive_before)
            drive, speed = np.array(drives[arms, moved]), np.array(qvel[arms, moved])
            change, self._drive_before = drive - self._drive_before, drive
            if beside is not None:
                told = control[its][:, self._columns]
                beyond = beside.beyond_servos(told, qpos[its], qvel[its])
                added[its] = beyond
                drive = drive.copy()
                drive[its] += beyond
            moment = Moment(
                time=(begin + index) * self.plant.timestep,
                timestep=self.plant.timestep,
                q=qpos[arms, logged],
                qd=speed,
                qd_before=self._speed_before,
                drive=drive,
                drive_change=change,
                gravity=bias[arms, moved],
                rotors=self._rotors,
            )
            if frictions:
                at_once, damping = rubbed.copy(), damped.copy()
                for each in frictions:
                    each.rub(Step(moment, each.rows), at_once, damping, added)
                rubs[arms, moved] = at_once
                if has_bristles:
                    damps[arms, moved] = damping
            for each in laws:
                added[each.rows] += each.law(Step(moment, each.rows), each.values, each.memory)
            applied[arms, moved] = added
            self._speed_before = speed
            batch.step(ids)
            q[:, index] = self._read(qpos[arms])
            tool[:, index] = sensors[arms, self._tool]
        if frictions:
            rubs[arms, moved] = rubbed
        if has_bristles:
            damps[arms, moved] = damped
        return q, tool


def _controls(model: mujoco.MjModel, actuator: int) -> np.ndarray:
    """Return which of the model's controls are an actuator's."""
    first = int(model.actuator_ctrladr[actuator])
    return np.arange(first, first + int(model.actuator_ctrlnum[actuator]))


def _motion_of(row: Row, recorded: Recorded) -> Hashable:
    """Return what is equal for arms that move alike."""
    return (
        id(recorded),
        id(row.command),
        row.initial_q.tobytes(),
        row.initial_qd.tobytes(),
        tuple(sorted((name, values.tobytes()) for name, values in row.fields.items())),
        tuple((id(law), values.tobytes()) for law, values in row.laws),
        tuple((id(one.law), one.values.tobytes(), one.ways.tobytes()) for one in row.frictions),
        None if row.encoders is None else row.encoders.scale.tobytes(),
        None if row.encoders is None else row.encoders.offset.tobytes(),
        tuple(sorted(row.forces.items())),
        frozenset(row.rests.items()),
        frozenset(row.speeds.items()),
    )


_CONSTANTS = frozenset(
    {
        "body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat",
        "dof_armature", "qpos0", "qpos_spring", "jnt_pos", "jnt_axis", "body_gravcomp",
    }
)  # fmt: skip
"""Fields that others are derived from."""
