"""Slopes and verdicts of a soak, on series whose growth is known."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from benchmarks.slopes import slope
from benchmarks.soaking import page
from benchmarks.soaking.samples import Ended, Kept, ProcessUse, Sample, Started, read
from benchmarks.soaking.verdict import judge, warm_up_of
from shared.errors import ConfigError

HOUR = 3600.0
STARTED = Started(minutes=120, cores=2, processor="CPU", commit="abc")


def test_a_straight_line_has_its_slope_and_no_width():
    found = slope([float(i) for i in range(100)], [3.0 + 0.5 * i for i in range(100)])
    assert found is not None
    assert (found.value, found.low, found.high) == pytest.approx((0.5, 0.5, 0.5))


def test_the_interval_is_students_over_the_blocks():
    found = slope([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 1.0, 3.0], blocks=4)
    # By hand: slope 0.9, residuals 0.1, 0.2, -0.7, 0.4, two degrees of freedom: t = 4.303.
    assert found is not None
    assert found.value == pytest.approx(0.9)
    assert found.high - found.value == pytest.approx(4.303 * (0.7 / 2 / 5) ** 0.5)


def test_nineteen_of_twenty_intervals_hold_the_planted_slope():
    generator = np.random.default_rng(1)
    times = np.arange(400.0)
    held = 0
    for _ in range(200):
        found = slope(list(times), list(0.01 * times + generator.standard_normal(400)))
        assert found is not None
        held += found.low <= 0.01 <= found.high
    assert 180 <= held <= 199


def test_too_short_a_series_has_no_slope():
    assert slope([0.0, 1.0, 2.0], [1.0, 1.0, 1.0]) is None
    assert slope([0.0] * 9, [1.0] * 9) is None


def sample(at: float, *, rss: float = 100e6, files: int = 30, late: float = 1.0, **more) -> Sample:
    fields = {
        "at": at, "version": int(at), "batch_samples": 20480, "lateness_ms": (0.1, late, 20.0),
        "ticks": int(100 * at), "ticks_late": 0, "ticks_lost": 0, "bouts": int(at / 20),
        "disk_bytes": {"train": int(1e4 * at), "play": 0}, "load": 3.0,
        "processes": {
            "train/league-0": ProcessUse(
                pid=7, rss_bytes=int(rss), files=files, threads=4, cpu_seconds=at
            )
        },
    }  # fmt: skip
    return Sample(**(fields | more))


def outcomes(samples: list[Sample], ended: str = "") -> dict[str, str]:
    verdict = judge(samples, ended)
    return {criterion.name: criterion.outcome for criterion in verdict.criteria}


def test_a_soak_in_which_nothing_grows_is_met():
    verdict = judge([sample(at) for at in range(0, 7200, 5)])
    assert verdict.outcome == "met", verdict.criteria
    assert verdict.rate == pytest.approx(20480)
    assert verdict.disk_mb_per_hour["train"] == pytest.approx(36.0)
    assert verdict.warm_up == 600.0


def test_what_fills_up_at_the_beginning_is_no_growth():
    filling = [sample(at, rss=100e6 + 5e5 * min(at, 500)) for at in range(0, 7200, 5)]
    assert judge(filling).outcome == "met"


@pytest.mark.parametrize(
    ("changed", "missed"),
    [
        (lambda at: {"rss": 100e6 + at / HOUR * 8e6}, "memory of train/league-0"),
        (lambda at: {"files": 30 + int(at / 600)}, "file handles, train/league-0 (the worst)"),
        (lambda at: {"late": 1.0 + 3.0 * at / HOUR}, "lateness of the control, p99"),
        (lambda at: {"ticks_late": int(3 * at)}, "control ticks over 10 ms late, or lost"),
        (lambda at: {"version": int(at - 0.05 * at * at / HOUR)}, "loss of training rate"),
        (
            lambda at: {"processes": {"train/league-0": ProcessUse(
                pid=7 if at < 3000 else 8, rss_bytes=10**8, files=30, threads=4, cpu_seconds=at
            )}},
            "processes that died",
        ),
    ],
)  # fmt: skip
def test_growth_beyond_its_limit_is_missed_and_nothing_else_is(changed, missed: str):
    found = outcomes([sample(at, **changed(at)) for at in range(0, 7200, 5)])
    assert found[missed] == "missed"
    assert [name for name, outcome in found.items() if outcome != "met"] == [missed]


def on_a_slowing_machine(at: float, *, rate: float) -> Sample:
    """Everything costs a third more CPU an hour later; the training falls by so much an hour."""
    slow = at + 0.33 * at * at / HOUR / 2
    robot = ProcessUse(pid=9, rss_bytes=10**8, files=30, threads=4, cpu_seconds=0.2 * slow)
    league = ProcessUse(pid=7, rss_bytes=10**8, files=30, threads=4, cpu_seconds=at)
    version = 10_000 + 1000 * (at - rate * at * at / HOUR / 2)
    processes = {"train/league-0": league, "play/robot-io-0": robot}
    return sample(at, version=int(version), processes=processes)


def test_a_training_as_slow_as_its_machine_has_lost_nothing_itself():
    verdict = judge([on_a_slowing_machine(at, rate=0.2) for at in range(0, 7200, 5)])
    raw, rate = (one for one in verdict.criteria if "rate" in one.name or "speed" in one.name)
    assert (raw.outcome, rate.outcome) == ("missed", "met"), (raw, rate)
    assert "changed by -" in verdict.as_measured
    assert "changed by +" in verdict.as_measured


def test_a_training_that_gets_slower_than_its_machine_is_missed():
    verdict = judge([on_a_slowing_machine(at, rate=0.45) for at in range(0, 7200, 5)])
    _, rate = (one for one in verdict.criteria if "rate" in one.name or "speed" in one.name)
    assert rate.outcome == "missed", rate


def test_a_noisy_soak_is_undecided_where_the_noise_hides_the_limit():
    generator = np.random.default_rng(0)
    noisy = [sample(at, rss=100e6 + 3e7 * generator.standard_normal()) for at in range(0, 7200, 5)]
    found = outcomes(noisy)
    assert found.pop("memory of train/league-0") == "undecided"
    assert set(found.values()) == {"met"}
    assert judge(noisy).outcome == "undecided"


def test_a_soak_too_short_for_slopes_judges_none_of_them():
    growing = [sample(at, rss=100e6 + 1e6 * at, ticks_late=50 * at) for at in range(0, 300, 5)]
    found = outcomes(growing)
    assert found["memory of train/league-0"] == "undecided"
    assert found["control ticks over 10 ms late, or lost"] == "missed"


def test_a_soak_that_a_death_ended_is_missed():
    samples = [sample(at) for at in range(0, 600, 5)]
    assert outcomes(samples, "actor-0 died")["nothing ended it early"] == "missed"


def test_a_killed_soak_is_read_up_to_its_last_whole_line(tmp_path: Path):
    path = tmp_path / "soak.jsonl"
    begin = msgspec.json.encode(STARTED) + b"\n"
    lines = [msgspec.json.encode(sample(at)) + b"\n" for at in range(0, 300, 5)]
    path.write_bytes(b"".join([begin, *lines, lines[0][:40]]))
    kept = read(path)
    assert (kept.started, len(kept.samples), kept.ended) == (STARTED, 60, "")
    assert judge(kept.samples).samples == 60
    path.write_bytes(b"".join([begin, *lines, msgspec.json.encode(Ended(ended="gone")) + b"\n"]))
    assert read(path).ended == "gone"


@pytest.mark.parametrize(("text", "reason"), [(b"{}\n", "line 1"), (b"", "empty"), (None, "read")])
def test_what_is_no_soak_is_refused(text: bytes | None, reason: str, tmp_path: Path):
    path = tmp_path / "soak.jsonl"
    if text is not None:
        path.write_bytes(text)
    with pytest.raises(ConfigError, match=reason):
        read(path)


def test_too_few_samples_are_refused():
    with pytest.raises(ValueError, match="at least 8"):
        judge([sample(at) for at in range(0, 40, 5)])
    with pytest.raises(ValueError, match="no sample"):
        judge([])
    assert (warm_up_of(60), warm_up_of(1800), warm_up_of(36_000)) == (30.0, 180.0, 600.0)


def test_the_block_is_put_into_the_page_and_replaced_there(tmp_path: Path):
    samples = [sample(at) for at in range(0, 7200, 5)]
    verdict = judge(samples)
    path = tmp_path / "reliability.md"
    page.write(path, page.block_of(verdict, Kept(STARTED, samples, "")))
    assert path.read_text().startswith("# Reliability\n\n## Soak\n\n<!-- soak:begin -->\n**met**")
    path.write_text("# R\n\nfaults\n\n## Soak\n\n" + path.read_text().partition("## Soak\n\n")[2])
    page.write(path, "again")
    expected = "# R\n\nfaults\n\n## Soak\n\n<!-- soak:begin -->\nagain\n<!-- soak:end -->\n"
    assert path.read_text() == expected
    path.write_text("# R\n\n## Soak\n\nlater\n")
    page.write(path, "now")
    assert path.read_text().count("## Soak") == 1
    assert path.read_text().endswith("<!-- soak:end -->\nlater\n")
    assert "✓ memory of train/league-0" in page.text_of(verdict)
