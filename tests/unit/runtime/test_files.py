import os
import subprocess
import sys
from pathlib import Path

import pytest

from shared.errors import RiposteError
from shared.runtime.files import RunLock, atomic_write, require_free_space

WRITE_WITH_A_LIMIT = """
import resource, sys
from shared.errors import RiposteError
from shared.runtime.files import atomic_write
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
try:
    atomic_write(sys.argv[1], b"x" * 8192)
except RiposteError as error:
    print(error)
"""


def test_a_file_is_written_whole_and_replaced(tmp_path: Path):
    path = tmp_path / "a.bin"
    atomic_write(path, b"one")
    atomic_write(path, memoryview(b"three"))
    assert path.read_bytes() == b"three"
    assert os.listdir(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("before", [b"old", None])
def test_without_space_the_old_file_stays_and_the_error_says_so(
    tmp_path: Path, before: bytes | None
):
    path = tmp_path / "checkpoint"
    if before is not None:
        path.write_bytes(before)
    done = subprocess.run(
        [sys.executable, "-c", WRITE_WITH_A_LIMIT, path], capture_output=True, text=True, timeout=30
    )
    assert f"no space left to write {path}" in done.stdout
    assert ("from before is intact" in done.stdout) == (before is not None)
    assert os.listdir(tmp_path) == (["checkpoint"] if before is not None else [])
    assert before is None or path.read_bytes() == before


def test_a_folder_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(RiposteError, match=r"cannot write .*missing.*: No such file"):
        atomic_write(tmp_path / "missing" / "a", b"")


def test_too_little_space_is_said_before_anything_starts(tmp_path: Path):
    require_free_space(tmp_path / "not" / "yet", 1)
    with pytest.raises(RiposteError, match=r"no space left: .* are needed"):
        require_free_space(tmp_path, 1 << 60)


def test_a_second_run_in_the_same_folder_is_refused_with_the_holder_named(tmp_path: Path):
    with (
        RunLock(tmp_path / "run"),
        pytest.raises(RiposteError, match=f"run is in use by process {os.getpid()}"),
    ):
        RunLock(tmp_path / "run")
    RunLock(tmp_path / "run").close()


def test_a_lock_is_free_again_when_its_process_was_killed(tmp_path: Path):
    code = (
        "import sys; from shared.runtime.files import RunLock; "
        "lock = RunLock(sys.argv[1]); print('locked', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", code, tmp_path]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"locked\n"
        with pytest.raises(RiposteError, match=f"in use by process {holder.pid}"):
            RunLock(tmp_path)
        holder.kill()
        holder.wait(10)
        RunLock(tmp_path).close()
