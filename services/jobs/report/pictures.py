"""Pictures of a trained pair at play, for the report: rendered, or drawn as lines without GL."""

import dataclasses
from pathlib import Path

import numpy as np
import structlog
from numpy.typing import NDArray

from services.league.snapshots import SnapshotStore
from shared.errors import RiposteError, SimulationError
from shared.game.rules import RuleBook
from shared.messages.training import AGENTS, OBS_DIM
from shared.policy.action import ActionConfig
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import Player, SnapshotPlayer, scripted_player
from shared.policy.snapshot import digest_of, unpack
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from shared.sim.render import SceneRenderer, encode_png
from shared.telemetry.figures import Segment, scene_drawing

WIDTH, HEIGHT = 960, 540
MOMENTS = 3

log = structlog.get_logger()


@dataclasses.dataclass(frozen=True)
class Picture:
    """One picture with what it shows."""

    caption: str
    png: bytes = b""
    svg: str = ""
    """Instead, where this machine cannot render."""


@dataclasses.dataclass(frozen=True)
class Moment:
    """One instant of a bout."""

    step: int
    qpos: NDArray[np.float64]
    """float64[14]."""
    positions: NDArray[np.float32]
    """float32[B, 3], of the bodies (m)."""
    blades: NDArray[np.float64]
    """float64[2, 2, 3], both ends of both bats (m)."""
    in_target: tuple[bool, bool]
    contact: bool
    score: float


def bout_pictures(
    folder: Path,
    players: tuple[str, str],
    sim: SimConfig,
    rules: RuleBook,
    action: ActionConfig,
    seed: int,
) -> list[Picture]:
    """Return pictures of one bout between two players; none when it cannot be played.

    Args:
        folder: of the run, with its snapshots.
        players: references of antagonist and protagonist.
        sim: the simulation the run was trained in.
        rules: its rule book.
        action: its action decoder.
        seed: draws the starting posture.
    """
    try:
        model = FencingModel.build(sim)
        store = SnapshotStore(folder / "snapshots")
        sides = (_player(store, players[0]), _player(store, players[1]))
    except RiposteError as error:
        log.warning("pictures_left_out", reason=str(error))
        return []
    moments = choose(play(model, sides, rules, action, seed))
    try:
        renderer = SceneRenderer(model, 2 * WIDTH, 2 * HEIGHT)
    except SimulationError as error:
        log.info("pictures_drawn_as_lines", reason=str(error))
        return [_drawing(model, moment) for moment in moments]
    try:
        return [
            Picture(caption(moment, model.cfg.control_timestep), png=_rendered(renderer, moment))
            for moment in moments
        ]
    finally:
        renderer.close()


def play(
    model: FencingModel,
    players: tuple[Player, Player],
    rules: RuleBook,
    action: ActionConfig,
    seed: int,
) -> list[Moment]:
    """Return every tenth instant of one bout."""
    generator = np.random.default_rng(seed)
    env = FencingEnv(model, rules, action, 1)
    antagonist, protagonist = players
    env.offset_scales = (antagonist.offset_scale, protagonist.offset_scale)
    env.reset(np.arange(1), generator)
    seen = (np.empty((1, OBS_DIM), np.float32), np.empty((1, OBS_DIM), np.float32))
    moments: list[Moment] = []
    for step in range(1, rules.bout_steps + 1):
        env.observe(*seen)
        judged = env.step(*(p.act(obs, generator) for p, obs in zip(players, seen, strict=True)))
        if step % 10 == 0:
            moments.append(
                Moment(
                    step=step,
                    qpos=env.batch.qpos[0].copy(),
                    positions=env.batch.body_poses(0)[0].copy(),
                    blades=_blades(model, env.batch.sensors[0]),
                    in_target=(
                        bool(judged.antagonist_in_target[0]),
                        bool(judged.protagonist_in_target[0]),
                    ),
                    contact=bool(judged.contact[0]),
                    score=float(env.scores.score[0]),
                )
            )
    return moments


def choose(moments: list[Moment]) -> list[Moment]:
    """Return moments that tell what the game is about, in the order they happened.

    The antagonist scoring, the bats touching, the protagonist guarding; where one never happens,
    evenly spread ones take its place.
    """
    late = [moment for moment in moments if moment.step >= 100] or moments
    wanted = (
        [m for m in late if m.in_target[0] and not m.contact],
        [m for m in late if m.contact],
        [m for m in late if m.in_target[1] and not m.in_target[0]],
    )
    chosen: list[Moment] = []
    for found in (*(w for w in wanted if w), *[late] * MOMENTS):
        if found and len(chosen) < MOMENTS:
            chosen.append(_farthest(found, chosen))
    return sorted(chosen, key=lambda moment: moment.step)


def _farthest(found: list[Moment], chosen: list[Moment]) -> Moment:
    """Return the moment that is farthest in time from those chosen; the middle one at first."""
    if not chosen:
        return found[len(found) // 2]
    return max(found, key=lambda m: min(abs(m.step - other.step) for other in chosen))


def caption(moment: Moment, control_timestep: float) -> str:
    """Return what a moment shows."""
    if moment.contact and moment.in_target[0]:
        what = "bats touch inside the target: the antagonist loses ten points"
    elif moment.contact:
        what = "bats touch outside the target"
    elif moment.in_target[0]:
        what = "the antagonist's bat is in the target and scores"
    elif moment.in_target[1]:
        what = "the protagonist guards the target"
    else:
        what = "nobody is in the target"
    return f"{moment.step * control_timestep:.1f} s: {what} (score {moment.score:+.0f})"


def _player(store: SnapshotStore, reference: str) -> Player:
    if reference.startswith("scripted:"):
        return scripted_player(reference)
    weights = unpack(store.get(reference), digest_of(reference)).weights
    return SnapshotPlayer(GaussianPolicy(weights), stochastic=False)


def _blades(model: FencingModel, sensors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return float64[2, 2, 3], where the bats begin and end (m)."""
    ends: list[NDArray[np.float64]] = []
    for side in range(2):
        grip, (w, x, y, z) = sensors[20 * side :][:3], sensors[20 * side :][3:7]
        along = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
        ends.append(np.stack([grip + model.bat_back * along, grip + model.bat_front * along]))
    return np.stack(ends)


def _rendered(renderer: SceneRenderer, moment: Moment) -> bytes:
    """Return a PNG, drawn at twice its size and averaged: smooth edges on any driver."""
    fine = renderer.draw(moment.qpos)
    blocks = fine.reshape(HEIGHT, 2, WIDTH, 2, 3).astype(np.uint16)
    return encode_png((blocks.sum(axis=(1, 3)) // 4).astype(np.uint8))


def _drawing(model: FencingModel, moment: Moment) -> Picture:
    segments: list[Segment] = []
    for side, agent in enumerate(AGENTS):
        arm = [b for b, name in enumerate(model.body_names) if name.startswith(f"{agent}/")]
        segments.append(Segment(agent, moment.positions[arm].tolist()))
        segments.append(Segment(agent, moment.blades[side].tolist(), blade=True))
    svg = scene_drawing(segments, model.target_centre.tolist(), model.target_radius)
    return Picture(caption(moment, model.cfg.control_timestep), svg=svg)
