import msgspec

from benchmarks.environments import REQUIREMENTS
from benchmarks.peer_loops.running import work_of
from benchmarks.peer_loops.work import WARM_UP, Stopwatch, Work
from benchmarks.peers import PEERS
from services.jobs.settings import Settings


def work(seconds: float) -> Work:
    return Work(
        opponent="", num_envs=8, batch_samples=80, hidden_dims=(4,), epochs=1, minibatches=1,
        learning_rate=1e-3, gamma=0.99, gae_lambda=0.95, clip=0.2, entropy_coef=0.0,
        value_loss_coef=1.0, max_grad_norm=1.0, initial_std=0.6, seconds=seconds,
    )  # fmt: skip


def test_the_window_opens_after_the_warm_up_and_holds_only_what_came_later():
    watch = Stopwatch(work(0.0))
    for update in range(1, WARM_UP + 1):
        assert not watch.update_done(80 * update)
    assert watch.update_done(80 * (WARM_UP + 1))
    timing = watch.timing(80 * (WARM_UP + 1))
    assert (timing.samples, timing.updates) == (80, 1)
    assert timing.wall_s > 0.0
    assert timing.resident_mib > 1.0


def test_a_window_goes_on_until_its_time_is_over():
    watch = Stopwatch(work(3600.0))
    assert not any(watch.update_done(80 * update) for update in range(1, 10))


def test_every_peer_gets_whole_rollouts_of_our_own_settings(tmp_path):
    settings = Settings.load(None)
    for peer in PEERS:
        given = work_of(peer, settings, tmp_path / "opponent", 1.0)
        assert given.steps * given.num_envs == settings.learner.batch_samples
        assert msgspec.json.decode(msgspec.json.encode(given), type=Work) == given


def test_every_environment_of_a_benchmark_is_pinned():
    files = {path.stem: path for path in REQUIREMENTS.glob("*.txt")}
    assert {peer.requirements for peer in PEERS if peer.requirements} < set(files)
    for path in files.values():
        lines = path.read_text(encoding="utf-8").split()
        assert lines
        assert all("==" in line for line in lines)
