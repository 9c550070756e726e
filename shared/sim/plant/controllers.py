"""Controllers of poses that know the arm by its encoders alone, as real ones do.

The simulator's servos act at the tool itself. That is the same as long as encoders, joints and
model agree; where a link is off its motor or an encoder is wrong, a real controller does not know:
its pose, velocity and Jacobian of the tool are those of an arm that stands where the encoders say.
Servos stay, since the simulator takes their damping implicitly; what a controller does differently
is added to them.
"""

from collections.abc import Sequence

import mujoco
import mujoco.batch
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import Plant
from shared.sim.plant.row import Row
from shared.sim.plant.structure import compiled, link_sums

_GAINS = ("actuator_gainprm", "actuator_biasprm")
_LIMITS = "jnt_actfrcrange"


class Controllers:
    """One for each of some arms of a batch."""

    def __init__(self, plant: Plant, model: mujoco.MjModel, capacity: int) -> None:
        """Compile the arm as its controller knows it.

        Args:
            plant: the arm.
            model: of the batch, with whatever was added to the arm.
            capacity: the most arms at once.
        """
        known = compiled(plant, ())
        unused = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_SENSOR
        known.opt.disableflags |= int(unused)
        self._known = known
        # Each arm twice: where its encoders say that it is, and where its links are.
        self._batch = mujoco.batch.Batch(known, nsim=2 * capacity, nthread=1)
        self._expanded = {name: self._batch.expand(name) for name in (*_GAINS, _LIMITS)}
        names = ("qpos", "qvel", "ctrl", "qfrc_actuator")  # bound before they are computed
        self._q, self._qd, self._command, self._torques = (self._batch.bind(n) for n in names)
        servos = [known.actuator(index).name for index in range(len(known.actuator_trntype))]
        self._servos = [int(model.actuator(name).id) for name in servos]
        joints = [known.joint(name) for name in plant.joints]
        self._limited = [int(joint.id) for joint in joints]
        self._qpos = np.array([int(joint.qposadr[0]) for joint in joints])
        self._dofs = np.array([int(joint.dofadr[0]) for joint in joints])
        own = [model.joint(name) for name in plant.joints]
        self._own = [int(joint.id) for joint in own]
        self._own_qpos = np.array([int(joint.qposadr[0]) for joint in own])
        self._own_dofs = np.array([int(joint.dofadr[0]) for joint in own])
        self._links = link_sums(plant, model)
        self.rows = np.empty(0, np.int64)
        """int64[K], the arms in their batch."""
        self._scale = self._offset = np.empty((0, len(plant.joints)))
        self._ids = np.empty(0, np.int32)
        self._at_q = self._at_qd = np.ix_(self._ids, self._qpos)

    def begin(self, rows: Sequence[Row]) -> None:
        """Take gains and limits of those arms of a batch that trust their encoders.

        Args:
            rows: all arms, with everything in them.
        """
        ours = [row for row in rows if row.encoders is not None]
        self.rows = np.array([row.index for row in ours], np.int64)
        encoders = [row.encoders for row in ours if row.encoders is not None]
        self._ids = np.arange(2 * len(ours), dtype=np.int32)
        self._at_q, self._at_qd = (np.ix_(self._ids, each) for each in (self._qpos, self._dofs))
        shape = len(ours), len(self._own)
        self._scale = np.reshape([each.scale for each in encoders], shape)
        self._offset = np.reshape([each.offset for each in encoders], shape)
        for index, row in enumerate(ours):
            for position in (index, len(ours) + index):
                for name in _GAINS:
                    own = self._expanded[name][position]
                    own[:] = row.current(name)[self._servos].reshape(own.shape)
                limits = self._expanded[_LIMITS][position].reshape(-1, 2)
                limits[self._limited] = row.current(_LIMITS)[self._own]

    def beyond_servos(self, command: Float64, qpos: Float64, qvel: Float64) -> Float64:
        """Return float64[K, J], what the controllers do beyond servos that see the tool (N m).

        Args:
            command: float64[K, U], controls of the servos.
            qpos: float64[K, Q], of the arms.
            qvel: float64[K, V].
        """
        count = len(self.rows)
        said = self._scale * qpos[:, self._own_qpos] + self._offset
        rate_said = self._scale * qvel[:, self._own_dofs]
        self._q[self._at_q] = np.concatenate([said, qpos @ self._links])
        self._qd[self._at_qd] = np.concatenate([rate_said, qvel @ self._links])
        self._command[: 2 * count] = np.concatenate([command, command])
        self._batch.forward(self._ids)
        torques = self._torques[self._at_qd]
        return np.asarray(torques[:count] - torques[count:], np.float64)
