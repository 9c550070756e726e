"""What a person perceives, late: the other bat by sight, the score by its tone.

Mean simple reaction times of young adults: about 190 ms to light and 160 ms to sound (Welford,
ed., Reaction Times, 1980; Kosinski's review); with a choice to be made more. The own bat is felt
without delay: a movement under way is steered by its own forward model.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.policy.scripted.blades import turned
from shared.policy.scripted.memory import Bools, Memory
from shared.policy.scripted.sight import OTHER, OWN, Arena, Sight, is_in_target, is_touching

Floats = NDArray[np.float64]
Tones = NDArray[np.int8]

SILENT, SCORING, PENALTY = 0, 1, 2
"""What is heard: nothing, the 440 Hz tone of a point, the 300 Hz tone of a penalty."""
_SEEN = 12
"""Numbers of the other bat in the delay line: grip, blade, velocity, turning."""


def tones(sight: Sight, arena: Arena) -> Tones:
    """Return int8[N], the tone that sounds now."""
    in_target = is_in_target(sight, OWN, arena)
    tone = np.where(is_touching(sight, arena), PENALTY, SCORING)
    return np.where(in_target, tone, SILENT).astype(np.int8)


@dataclasses.dataclass(frozen=True)
class Senses:
    """The delay lines of N people, kept in a memory."""

    memory: Memory
    arena: Arena
    sight_steps: int
    """Control steps by which the other bat is seen late."""
    hearing_steps: int
    """Control steps by which a tone is heard late."""
    anticipation: float
    """Share of the delay that is made up for by carrying on the motion that was seen."""
    lead: float
    """Seconds farther that the motion is carried on."""

    def allocate(self, count: int) -> None:
        """Make room for N worlds."""
        self.memory["seen"] = np.zeros((self.sight_steps + 1, _SEEN, count))
        self.memory["heard"] = np.zeros((self.hearing_steps + 1, count), np.int8)
        self.memory["step"] = np.zeros(1, np.int64)

    def begin(self, where: Bools, sight: Sight) -> None:
        """Forget what was on its way in these worlds: nothing has moved, nothing has sounded."""
        self.memory["seen"][:, :, where] = _other(sight)[:, where]
        self.memory["heard"][:, where] = SILENT

    def perceive(self, sight: Sight) -> tuple[Floats, Floats, Tones]:
        """Take in what is there now; return what gets through now.

        Returns:
            float64[3, N] the other grips and float64[3, N] the other blades, as they are expected
            to be, and int8[N] the tones.
        """
        seen, heard, step = self.memory["seen"], self.memory["heard"], self.memory["step"]
        now = int(step[0])
        seen[now % len(seen)] = _other(sight)
        heard[now % len(heard)] = tones(sight, self.arena)
        step += 1
        late = seen[(now + 1) % len(seen)]
        delay = self.sight_steps * self.arena.control_timestep
        ahead = self.anticipation * delay + self.lead
        grips = late[0:3] + ahead * late[6:9]
        blades = turned(late[3:6], ahead * late[9:12])
        return grips, blades, heard[(now + 1) % len(heard)].copy()


def _other(sight: Sight) -> Floats:
    """Return float64[12, N]."""
    views = (sight.grips, sight.blades, sight.velocities, sight.turning)
    return np.concatenate([view[:, OTHER] for view in views])
