import os
import subprocess
import sys
import types
from importlib import util

import pytest

from services import cli
from shared.errors import ConfigError
from shared.runtime.process import THREAD_LIMITS


@pytest.fixture
def command(monkeypatch):
    """Make ``riposte try`` run a function."""

    def make(entry) -> None:
        module = types.ModuleType("tried")
        module.main = entry  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "services.tried", module)
        monkeypatch.setitem(cli.COMMANDS, "try", cli.Command("try", "tried", "a test"))

    return make


@pytest.mark.parametrize("name", sorted(cli.COMMANDS))
def test_every_listed_command_is_there(name: str):
    assert util.find_spec(f"services.{cli.COMMANDS[name].module}") is not None


def test_help_lists_every_command_and_loads_none():
    code = (
        "import sys; from services import cli; assert cli.main(['--help']) == 0; "
        "heavy = {'numpy', 'torch', 'mujoco', 'zenoh', 'rerun', 'rich'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=30
    )
    assert done.returncode == 0, done.stderr
    assert all(f"  {name} " in done.stdout for name in cli.COMMANDS)


@pytest.mark.parametrize(("chosen", "threads"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_a_command_computes_on_one_thread_unless_told_otherwise(chosen, threads: str):
    code = (
        "import os, sys, types; from services import cli\n"
        "def main(argv):\n"
        "    print('numpy' in sys.modules, os.environ['OPENBLAS_NUM_THREADS'])\n"
        "    import numpy; a = numpy.ones((500, 500), numpy.float32); a @ a\n"
        "    print(len(os.listdir('/proc/self/task')))\n"
        "sys.modules['services.tried'] = tried = types.ModuleType('tried'); tried.main = main\n"
        "cli.COMMANDS['try'] = cli.Command('try', 'tried', 'a test'); cli.main(['try'])"
    )
    unset = {name: value for name, value in os.environ.items() if name not in THREAD_LIMITS}
    done = subprocess.run(
        [sys.executable, "-P", "-c", code],
        capture_output=True,
        text=True,
        timeout=30,
        env=unset | chosen,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["False", threads, str(min(int(threads), os.cpu_count() or 1))]


def test_an_unknown_command_is_answered_with_the_nearest_one(capsys):
    assert cli.main(["trian"]) == 2
    assert capsys.readouterr().err == "riposte: unknown command 'trian'; did you mean 'train'?\n"


def test_no_command_prints_the_help_and_fails(capsys):
    assert cli.main([]) == 2
    assert capsys.readouterr().out.startswith("usage: riposte")


def test_the_version_is_the_distributions(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("riposte 0.")


def test_the_exit_code_of_a_command_is_passed_on(command):
    command(lambda argv: len(argv))
    assert cli.main(["try", "a", "b"]) == 2
    assert cli.main(["try"]) == 0


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (ConfigError("num_envs is odd"), 2, "riposte: try: num_envs is odd\n"),
        (KeyboardInterrupt(), 130, "riposte: try: interrupted\n"),
        (
            ModuleNotFoundError("No module named 'torch'", name="torch"),
            2,
            "riposte: try needs torch: pip install 'riposte[train]'\n",
        ),
    ],
)
def test_what_a_user_can_mend_is_one_line(command, capsys, error, code: int, line: str):
    def entry(argv) -> int:
        raise error

    command(entry)
    assert cli.main(["try"]) == code
    assert capsys.readouterr().err == line


def test_a_bug_is_not_hidden(command):
    def entry(argv) -> int:
        raise ModuleNotFoundError("No module named 'sharde'", name="sharde")

    command(entry)
    with pytest.raises(ModuleNotFoundError, match="sharde"):
        cli.main(["try"])


def test_help_that_nobody_reads_on_ends_quietly():
    command = f"{sys.executable} -m services.cli --help | true"
    ended = subprocess.run(
        ["bash", "-c", f"set -o pipefail; sleep 0.2; {command}"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (0, "")
