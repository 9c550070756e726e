"""Simulated people as antagonists: late senses, smooth and noisy reaching, search, strategy.

A person does not see the target: it knows about where it is, aims there, and moves its guess with
the tones it hears. Each attack comes from one of a few directions; a tactic says from which, and
one of the three people learns from bout to bout which tactic pays. What is believed and preferred
is kept from bout to bout.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import distance_between_bats
from shared.policy.scripted.blades import unit
from shared.policy.scripted.memory import Bools, Remembering
from shared.policy.scripted.reaching import Reaching, noisy
from shared.policy.scripted.senses import PENALTY, SCORING, Senses, Tones
from shared.policy.scripted.sight import OWN, Arena, Sight
from shared.policy.scripted.tracking import track

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]

APPROACHES: Floats = unit(
    np.array(
        [
            [0.80, 0.00, 0.60],  # from below
            [0.75, 0.50, 0.43],  # from below, right
            [0.75, 0.66, 0.00],  # from the right
            [0.80, -0.60, 0.00],  # from the left
            [0.70, -0.50, -0.50],  # from above, left
            [1.00, 0.00, 0.00],  # straight
        ]
    ).T
)
"""Directions of the blade in an attack, one a column; 0 to 5 are also the tactics of attacking
from nowhere else."""
CLEAREST = APPROACHES.shape[1]
"""The tactic of attacking from where the way in is clearest of the other blade, as it is seen."""
ANY = CLEAREST + 1
"""The tactic of attacking from anywhere."""
TACTICS = ANY + 1
"""How many tactics there are."""
DEPTH = 0.60
"""Of the blade, from the grip, that is aimed at the guess (m)."""
READY_GRIP: Floats = np.array([[-0.62], [-0.25], [-0.15]])
READY_BLADE: Floats = unit(np.array([[0.35], [0.10], [0.93]]))
"""Where the bat waits, clear of the target."""

_READY, _ATTACKING, _LEAVING = 0, 1, 2
_SILENCE = 0.35
"""Seconds in place without a tone after which the guess is held to be wrong."""
_CERTAIN = 0.02
"""Spread below which a guess does not get (m)."""
_LEARNING = 0.05
"""Share by which a guess moves, a step with a tone, to the nearest point of the blade."""
_SURER, _LESS_SURE = 0.98, 1.3
"""Factors of the spread, for a step with a tone and for a guess given up."""


@dataclasses.dataclass(frozen=True)
class Character:
    """What sets one person apart from another."""

    tactic: int | None
    """What it does in every bout; None: what has paid best so far, by the score it heard."""
    sight_seconds: float
    """Delay of what is seen."""
    hearing_seconds: float
    """Delay of what is heard."""
    anticipation: float
    """Share of the delay of sight that is made up for by carrying on the motion seen."""
    lead: float
    """Seconds farther than that which it looks ahead."""
    peak_speed: float
    """Of the hand (m/s)."""
    noise: float
    """Standard deviation over size of a motor command."""
    spread: float
    """Of the first guess of the target's place on each axis (m)."""
    caution: float
    """Distance between the blades at which an attack is broken off (m); 0: only when hit."""
    pause: tuple[float, float]
    """Seconds between two attacks, uniform."""


NOVICE = Character(
    tactic=ANY, sight_seconds=0.25, hearing_seconds=0.22, anticipation=0.0, lead=0.0,
    peak_speed=1.2, noise=0.20, spread=0.12, caution=0.0, pause=(0.5, 1.2),
)  # fmt: skip
STEADY = Character(
    tactic=CLEAREST, sight_seconds=0.22, hearing_seconds=0.19, anticipation=0.5, lead=0.0,
    peak_speed=1.5, noise=0.15, spread=0.08, caution=0.08, pause=(0.2, 0.6),
)  # fmt: skip
ADAPTIVE = Character(
    tactic=None, sight_seconds=0.20, hearing_seconds=0.17, anticipation=1.0, lead=0.03,
    peak_speed=1.8, noise=0.10, spread=0.08, caution=0.08, pause=(0.1, 0.4),
)  # fmt: skip

EXPLORATION = 0.1
"""Chance that a learning person plays a bout by any tactic (epsilon-greedy; Sutton & Barto 2018,
section 2.2)."""
RECENCY = 0.3
"""Share by which a bout's score replaces what a tactic was worth (ibid., section 2.5)."""


class Person(Remembering):
    """A person with a bat."""

    offset_scale = 4.0
    """How many times farther than the trained antagonist it may command: faster than that one's
    bound, not faster than the arm's joints."""

    def __init__(self, arena: Arena, character: Character) -> None:
        super().__init__(arena.with_bounds_scaled(self.offset_scale))
        self.become(character)

    def become(self, character: Character) -> None:
        """Play as this character from the next bout on; what was learned stays."""
        self._character = character
        self._reaching = Reaching(self._memory, character.peak_speed)
        self._senses = Senses(
            self._memory,
            self._arena,
            round(character.sight_seconds / self._arena.control_timestep),
            round(character.hearing_seconds / self._arena.control_timestep),
            character.anticipation,
            character.lead,
        )
        if (count := self._memory.count) is not None:
            self._senses.allocate(count)

    def act(self, obs: Float32s, generator: np.random.Generator) -> Float32s:
        """Return float32[N, 6]."""
        sight = Sight.of(obs)
        wanted = self.wish(sight, generator)
        return noisy(track(sight, *wanted, self._arena), self._character.noise, generator)

    def wish(self, sight: Sight, generator: np.random.Generator) -> tuple[Floats, Floats]:
        """Return where grips and blades should be now: float64[3, N] each."""
        is_new = self._memory.begin(sight.seconds)
        if is_new is None:
            is_new = np.ones(len(sight.seconds), np.bool_)
            self._allocate(len(is_new), generator)
        if is_new.any():
            self._begin_bout(is_new, sight, generator)
        grips, blades, heard = self._senses.perceive(sight)
        self._learn(sight, heard)
        self._decide(sight, grips, blades, heard, generator)
        return self._reaching.pose(sight.seconds)

    def _allocate(self, count: int, generator: np.random.Generator) -> None:
        memory = self._memory
        self._senses.allocate(count)
        self._reaching.allocate(count)
        spread = self._character.spread
        memory["guess"] = spread * generator.standard_normal((3, count))
        memory["known"] = memory["guess"].copy()
        memory["spread"] = np.full(count, spread)
        memory["phase"] = np.zeros(count, np.int8)
        memory["until"] = np.zeros(count)
        memory["last_point"] = np.zeros(count)
        memory["approach"] = np.zeros(count, np.int64)
        memory["tactic"] = np.full(count, -1)
        memory["heard_score"] = np.zeros(count)
        memory["worth"] = np.full((TACTICS, count), np.inf)

    def _begin_bout(self, where: Bools, sight: Sight, generator: np.random.Generator) -> None:
        """Draw the lesson of the bout before, choose anew, and get ready."""
        memory, now = self._memory, sight.seconds
        self._senses.begin(where, sight)
        played = np.flatnonzero(where & (memory["tactic"] >= 0))
        tactic, score = memory["tactic"][played], memory["heard_score"][played]
        before = memory["worth"][tactic, played]
        first = np.isinf(before)
        before[first] = score[first]
        memory["worth"][tactic, played] = before + RECENCY * (score - before)
        memory["heard_score"][where] = 0.0
        always = self._character.tactic
        memory["tactic"][where] = self._preferred(where, generator) if always is None else always
        self._start(_READY, where, sight)
        memory["until"][where] = now[where] + self._pauses(where, generator)

    def _preferred(self, where: Bools, generator: np.random.Generator) -> NDArray[np.int64]:
        """Return int64[K], for each of these worlds an untried tactic, or the best one."""
        worth = self._memory["worth"][:, where]
        order = generator.random(worth.shape)  # settles ties between the untried ones
        best: NDArray[np.int64] = np.lexsort((order, worth), axis=0)[-1]
        explore = generator.random(best.shape) < EXPLORATION
        return np.where(explore, order.argmax(axis=0), best)

    def _learn(self, sight: Sight, heard: Tones) -> None:
        """Move the guess with the tone of a point, and keep the score."""
        memory = self._memory
        point, penalty = heard == SCORING, heard == PENALTY
        memory["heard_score"] += np.where(point, 1.0, np.where(penalty, -10.0, 0.0))
        # What is heard on the way out belongs to where the blade was: no news of the target.
        news = point & (memory["phase"] == _ATTACKING)
        if news.any():
            grips, blades = sight.grips[:, OWN], sight.blades[:, OWN]
            guess, bat = memory["guess"], self._arena.bat
            along = np.clip(((guess - grips) * blades).sum(0), bat.back, bat.front)
            moved = guess + _LEARNING * (grips + along * blades - guess)
            guess[:, news] = memory["known"][:, news] = moved[:, news]
            memory["spread"][news] = np.maximum(memory["spread"][news] * _SURER, _CERTAIN)
            memory["last_point"][news] = sight.seconds[news]

    def _decide(
        self,
        sight: Sight,
        grips: Floats,
        blades: Floats,
        heard: Tones,
        generator: np.random.Generator,
    ) -> None:
        """Begin what is to be begun: an attack, a search, a retreat, a rest."""
        memory, now = self._memory, sight.seconds
        phase, arrived = memory["phase"], self._reaching.arrived_for(now)
        attacking = phase == _ATTACKING
        leave = attacking & (heard == PENALTY)
        if self._character.caution > 0.0:
            own, blade = sight.grips[:, OWN], sight.blades[:, OWN]
            between = distance_between_bats(own, blade, grips, blades, self._arena.bat)
            leave |= attacking & (arrived > 0.0) & (between < self._character.caution)
        silent_since = np.maximum(memory["last_point"], now - arrived)
        search = attacking & ~leave & (arrived > 0.0) & (now - silent_since > _SILENCE)
        rest = (phase == _LEAVING) & (arrived > 0.0)
        attack = (phase == _READY) & (now >= memory["until"])
        if leave.any():
            self._start(_LEAVING, leave, sight)
        if rest.any():
            phase[rest] = _READY
            memory["until"][rest] = now[rest] + self._pauses(rest, generator)
        if search.any():
            self._guess_again(search, generator)
        if attack.any():
            self._choose(attack, grips, blades, generator)
        if search.any() or attack.any():
            self._start(_ATTACKING, search | attack, sight)

    def _guess_again(self, where: Bools, generator: np.random.Generator) -> None:
        """Look for the target elsewhere around where it was last known to be."""
        memory = self._memory
        count = int(np.count_nonzero(where))
        spread = np.minimum(memory["spread"][where] * _LESS_SURE, self._character.spread)
        memory["spread"][where] = spread
        drawn = spread * generator.standard_normal((3, count))
        memory["guess"][:, where] = memory["known"][:, where] + drawn

    def _choose(
        self, where: Bools, grips: Floats, blades: Floats, generator: np.random.Generator
    ) -> None:
        """Choose the direction of the attack that begins in these worlds."""
        memory, places = self._memory, np.flatnonzero(where)
        tactic, kinds = memory["tactic"][places], APPROACHES.shape[1]
        ways = np.repeat(APPROACHES[:, :, None], len(places), axis=2)
        hands = memory["guess"][:, None, places] - DEPTH * ways
        other, blade = grips[:, None, places], blades[:, None, places]
        clear = distance_between_bats(hands, ways, other, blade, self._arena.bat).argmax(axis=0)
        drawn = generator.integers(kinds, size=len(places))
        chosen = np.where(tactic == CLEAREST, clear, np.where(tactic == ANY, drawn, tactic))
        memory["approach"][places] = chosen

    def _start(self, phase: int, where: Bools, sight: Sight) -> None:
        """Begin to move: into the attack, or to where the bat waits."""
        memory = self._memory
        memory["phase"][where] = phase
        if phase == _ATTACKING:
            ways = APPROACHES[:, memory["approach"]]
            end = (memory["guess"] - DEPTH * ways, ways)
            memory["last_point"][where] = -np.inf
        else:
            everywhere = np.ones(len(where))
            end = (READY_GRIP * everywhere, READY_BLADE * everywhere)
        start = (sight.grips[:, OWN], sight.blades[:, OWN])
        self._reaching.begin(where, sight.seconds, start, end)

    def _pauses(self, where: Bools, generator: np.random.Generator) -> Floats:
        return generator.uniform(*self._character.pause, int(np.count_nonzero(where)))
