import numpy as np
import pytest

from services.recorder.playback import Playback
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.telemetry.bout import BoutRows
from tests.unit.recorder.bouts import frames

MODEL = FencingModel.build(SimConfig())


def playback(steps: int = 200) -> Playback:
    return Playback(control_timestep=0.01, frames_per_second=25.0, bout_steps=steps)


def shown(player: Playback, begin: float, end: float, period: float = 0.25) -> list[BoutRows]:
    instants = np.arange(begin, end, period)
    found = [player.due(float(t), round(t * 1e9)) for t in instants]
    return [rows for rows in found if rows is not None]


def test_a_bout_played_in_an_instant_is_shown_in_real_time() -> None:
    player = playback()
    for first in range(4, 200, 40):
        assert player.offer(frames(MODEL, list(range(first, min(first + 40, 201), 4))))

    rows = BoutRows.join(shown(player, 10.0, 13.0))

    assert rows.control_step.tolist() == list(range(4, 201, 4))
    assert np.diff(rows.wall_ns) == pytest.approx(0.04e9, abs=2)


def test_only_what_is_due_is_shown() -> None:
    player = playback()
    player.offer(frames(MODEL, list(range(4, 201, 4))))
    player.due(5.0, 0)

    rows = player.due(5.5, 0)

    assert rows is not None
    assert rows.control_step[-1] == 52
    assert player.waiting_frames == 50 - 13


def test_bouts_lie_end_to_end_on_the_step_timeline() -> None:
    player = playback()
    player.offer(frames(MODEL, list(range(4, 201, 4)), bout=0))
    player.offer(frames(MODEL, list(range(4, 201, 4)), bout=1))

    rows = BoutRows.join(shown(player, 1.0, 8.0))

    assert len(rows) == 100
    assert (np.diff(rows.control_step) > 0).all()
    assert rows.score[50] == 4.0


def test_the_newest_bout_is_next_and_older_ones_are_left_out() -> None:
    player = playback()
    player.offer(frames(MODEL, list(range(4, 201, 4)), bout=0))
    for bout in (1, 2, 3):
        player.offer(frames(MODEL, list(range(4, 201, 4)), bout=bout))

    first = player.take_started()
    shown(player, 1.0, 4.0)
    second = player.take_started()

    assert first is not None
    assert second is not None
    assert (first.bout, second.bout) == (0, 3)
    assert player.waiting_frames <= 100


def test_a_bout_without_its_beginning_is_not_lined_up() -> None:
    player = playback()
    player.offer(frames(MODEL, list(range(4, 201, 4)), bout=0))

    assert not player.offer(frames(MODEL, list(range(120, 201, 4)), bout=1))


def test_a_pause_of_the_actor_pauses_the_show() -> None:
    player = playback()
    player.offer(frames(MODEL, list(range(4, 41, 4))))
    shown(player, 1.0, 9.1)
    player.offer(frames(MODEL, list(range(44, 81, 4))))

    rows = player.due(9.1, 0)

    assert rows is not None
    assert rows.control_step[0] == 44
    assert rows.control_step[-1] <= 56


def test_a_bout_that_breaks_off_gives_way_to_the_next() -> None:
    player = playback(steps=2000)
    player.offer(frames(MODEL, [4, 8, 12], bout=0))
    shown(player, 1.0, 2.0)
    player.offer(frames(MODEL, [4, 8, 12], bout=1))

    rows = BoutRows.join(shown(player, 2.0, 5.0))

    assert len(rows) == 3


def test_a_touch_between_two_shown_instants_is_not_lost() -> None:
    player = playback()
    player.offer(frames(MODEL, list(range(1, 41)), contact=[7, 22]))

    rows = BoutRows.join(shown(player, 1.0, 2.0))

    assert rows.control_step.tolist() == list(range(1, 41, 4))
    assert rows.control_step[rows.contact].tolist() == [9, 25]


def test_no_frames_are_nothing_to_show() -> None:
    player = playback()

    assert not player.offer(frames(MODEL, []))
    assert player.due(1.0, 0) is None
