"""A Slurm cluster of one node on this machine: munged, slurmctld and slurmd, in one folder."""

import getpass
import os
import re
import secrets
import shutil
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from shared.bus.ports import free_port
from shared.runtime.process import end

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "squeue", "scancel")
PATHS = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"
START_SECONDS = 60.0
CONFIGURATION = """
ClusterName=here
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmctldPort={control}
SlurmdPort={node}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
ReturnToService=2
MpiDefault=none
NodeName={host} NodeAddr=127.0.0.1 CPUs=8 RealMemory=16000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE
"""
"""Room for eight tasks, however many processors there are."""


def unavailable() -> str:
    """Return why no cluster can be made here; empty when one can."""
    missing = [name for name in PROGRAMS if shutil.which(name, path=PATHS) is None]
    if missing:
        return f"needs {', '.join(missing)}: apt install slurm-wlm munge"
    return "" if os.geteuid() == 0 else "slurmd needs root"


class Slurm:
    """The cluster; jobs are submitted from, and write to, its folder."""

    def __init__(self, folder: Path) -> None:
        """Configure it in an empty folder whose path is short (a socket is in it)."""
        self.folder = folder
        for name in ("state", "spool"):
            (folder / name).mkdir()
        key = folder / "munge.key"
        key.touch(0o400)
        key.write_bytes(secrets.token_bytes(1024))
        made = CONFIGURATION.format(
            host=socket.gethostname().partition(".")[0], user=getpass.getuser(), folder=folder,
            control=free_port(), node=free_port(),
        )  # fmt: skip
        (folder / "slurm.conf").write_text(made)
        self._environment = os.environ | {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": PATHS}
        self._daemons: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        munge = {name: f"--{name}={self.folder / file}" for name, file in (
            ("key-file", "munge.key"), ("socket", "munge.socket"), ("pid-file", "munged.pid"),
            ("log-file", "munged.log"), ("seed-file", "munged.seed"),
        )}  # fmt: skip
        self._start("munged", "--foreground", "--force", *munge.values())
        self._await("munged", (self.folder / "munge.socket").exists)
        self._start("slurmctld", "-D")
        self._start("slurmd", "-D")
        self._await("slurmd", lambda: self._ask("sinfo", "-h", "-o", "%t") == "idle")
        return self

    def __exit__(self, *_: object) -> None:
        if len(self._daemons) == 3:
            self._ask("scancel", "--quiet", f"--user={getpass.getuser()}")
            self._ask("scancel", "--quiet", "--signal=KILL", f"--user={getpass.getuser()}")
        end(reversed(self._daemons), 20.0)

    def _start(self, program: str, *words: str) -> None:
        with (self.folder / f"{program}.out").open("wb") as output:
            self._daemons.append(
                subprocess.Popen([program, *words], env=self._environment, stdout=output,
                                 stderr=output, start_new_session=True)
            )  # fmt: skip

    def _await(self, program: str, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + START_SECONDS
        while not condition():
            said = (self.folder / f"{program}.out").read_text()[-2000:]
            assert all(process.poll() is None for process in self._daemons), said
            assert time.monotonic() < deadline, said
            time.sleep(0.1)

    def _ask(self, *words: str | Path, **more: str) -> str:
        done = subprocess.run(
            words, env=self._environment | more, cwd=self.folder, capture_output=True, text=True,
            timeout=60, check=False,
        )  # fmt: skip
        return done.stdout.strip() if done.returncode == 0 else ""

    def submit(self, script: Path, *words: str, **environment: str) -> int:
        """Submit a script; return the job's number."""
        said = self._ask("sbatch", *words, script, **environment)
        found = re.fullmatch(r"Submitted batch job (\d+)", said)
        assert found, (said, (self.folder / "slurmctld.out").read_text()[-2000:])
        return int(found[1])

    def states(self, job: int) -> dict[str, str]:
        """Return the state of each task of an array, ended ones among them."""
        said = self._ask("squeue", "-h", "-t", "all", "--array", "-j", str(job), "-o", "%i %T")
        return {
            task: state for task, _, state in (line.partition(" ") for line in said.split("\n"))
        }

    def exit_codes(self, job: int) -> set[str]:
        """Return the exit codes of an array's tasks, ``code:signal`` each."""
        return set(
            re.findall(r"\bExitCode=(\S+)", self._ask("scontrol", "show", "job", "-o", str(job)))
        )

    def cancel(self, job: int) -> None:
        """Tell a job to end, as its user would."""
        self._ask("scancel", str(job))

    def said(self, job: int) -> str:
        """Return what the tasks of an array of actors have printed."""
        return "".join(path.read_text() for path in sorted(self.folder.glob(f"*-{job}_*.log")))
