"""What goes from the process that polls SteamVR to the one that moves a robot."""

import socket
from collections.abc import Iterator

import pytest

from services.robot_io.poses import Pose
from services.robot_io.vive.child import BUFFER_BYTES
from services.robot_io.vive.poller import MAX_BYTES, Report, Sender, packed, unpacked
from services.robot_io.vive.source import KEPT, Sample, Status, ViveSource
from shared.clock import ManualClock
from tests.unit.vive.steamvr import Scripted

POSE = Pose((1.0, 2.0, 3.0), (0.5, 0.5, -0.5, 0.5))


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
    with ours, theirs:
        yield ours, theirs


def taken(end: socket.socket) -> list[Sample | Report | None]:
    found = []
    while True:
        try:
            found.append(unpacked(end.recv(MAX_BYTES, socket.MSG_DONTWAIT)))
        except BlockingIOError:
            return found


def test_a_pose_is_what_it_was_on_the_other_side():
    sample = Sample(12.5, POSE)
    assert unpacked(packed(sample)) == sample


@pytest.mark.parametrize("data", [b"x", b"{}", b'{"status": 1}', bytes(63), bytes(65)])
def test_what_is_neither_pose_nor_report_is_nothing(data: bytes):
    assert unpacked(data) is None


def test_poses_and_what_has_changed_are_sent(ends: tuple[socket.socket, socket.socket]):
    ours, theirs = ends
    clock = ManualClock(10.0)
    steamvr = Scripted(POSE)
    source = ViveSource(steamvr, "LHR-1", clock)
    sender = Sender(source, theirs)
    for _ in range(3):
        source.poll()
        sender.send(clock.now())
        clock.advance(0.004)
    found = taken(ours)
    assert [item.pose for item in found if isinstance(item, Sample)] == [POSE, POSE]
    reports = [item for item in found if isinstance(item, Report)]
    assert reports[-1].status == Status(problem="", is_connected=True, battery=0.5)
    steamvr.pose = None
    source.poll()
    sender.send(clock.now())
    (report,) = taken(ours)
    assert isinstance(report, Report)
    assert "lost the tracker LHR-1" in report.status.problem
    assert report.counters["tracker_bad_poses"] == 1


def test_a_reader_that_does_not_read_costs_the_poses_that_do_not_fit_and_nothing_else(
    ends: tuple[socket.socket, socket.socket],
):
    ours, theirs = ends
    clock = ManualClock(10.0)
    source = ViveSource(Scripted(POSE), "LHR-1", clock)
    sender = Sender(source, theirs)
    for _ in range(1000):
        source.poll()
        sender.send(clock.now())
        clock.advance(0.004)
    waiting = [item for item in taken(ours) if isinstance(item, Sample)]
    assert 20 <= len(waiting) <= 100
    clock.advance(1.0)
    source.poll()
    sender.send(clock.now())
    report = taken(ours)[-1]
    assert isinstance(report, Report)
    assert report.counters["tracker_poses_lost"] >= 1000 - 2 - len(waiting)


def test_a_source_that_nobody_takes_from_keeps_the_newest():
    clock = ManualClock(10.0)
    source = ViveSource(Scripted(POSE), "LHR-1", clock)
    for _ in range(KEPT + 11):
        source.poll()
        clock.advance(0.004)
    samples = source.take()
    assert len(samples) == KEPT
    assert samples[-1].at == pytest.approx(clock.now() - 0.004)
    assert source.counters["tracker_poses_lost"] == 10
    assert source.take() == []


def test_the_rate_is_that_of_the_last_second():
    clock = ManualClock(10.0)
    source = ViveSource(Scripted(POSE), "LHR-1", clock)
    for _ in range(800):
        source.poll()
        clock.advance(0.004)
    assert source.status.polls_per_s == pytest.approx(250.0, rel=0.02)


def test_one_that_is_gone_is_told_by_the_socket(ends: tuple[socket.socket, socket.socket]):
    ours, theirs = ends
    ours.close()
    source = ViveSource(Scripted(POSE), "LHR-1", ManualClock(10.0))
    source.poll()
    with pytest.raises(OSError, match="Broken pipe"):
        Sender(source, theirs).send(10.0)
