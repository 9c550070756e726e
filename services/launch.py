"""Becomes another program that the kernel kills when the process that started it dies.

``python -I -S launch.py PARENT PROGRAM [ARGS]``. A program of its own, since code between fork and
exec in a process with threads may deadlock; imports next to nothing, since every start pays for it.
"""

import ctypes
import os
import signal
import sys

PR_SET_PDEATHSIG = 1


def main(argv: list[str]) -> None:
    """Ask for the signal, check that the parent has not died before, become the program."""
    parent, program = int(argv[0]), argv[1:]
    if ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0) != 0:
        sys.exit("launch: the kernel refused PR_SET_PDEATHSIG")
    if os.getppid() != parent:
        sys.exit("launch: the supervisor died first")
    try:
        os.execvp(program[0], program)
    except OSError as error:
        sys.exit(f"launch: cannot run {program[0]}: {error.strerror}")


if __name__ == "__main__":
    main(sys.argv[1:])
