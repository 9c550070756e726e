"""Which tests run beside which, where two workers share them.

What only takes longer beside other work runs beside it; what has to keep time comes last, in one
worker, when the other has next to nothing left to do.
"""

from typing import Final

_KINDS: Final = ("jobs", "", "files", "in time")
"""In this order: those that stay with one worker, all of them or those of a file; "": any test."""
_INTEGRATION: Final = "tests/integration/"
_COMPUTING: Final = ("identification", "sim")
"""Integration tests that start no processes."""
_JOBS: Final = ("training", "tournament", "serial", "closing_the_loop", "identify_job")
"""Integration tests of whole jobs, which wait for nothing but their own processes."""
_LONG: Final = "tests/integration/identification/test_hidden_effects.py"
"""Each of its tests takes half a minute, and none needs what another one has made."""


def turn(nodeid: str) -> int:
    """Return when it is a test's turn: after those of smaller numbers."""
    return _KINDS.index(_kind(_file(nodeid)))


def company(nodeid: str) -> str:
    """Return a name that a test shares with those that stay with its worker."""
    file = _file(nodeid)
    kind = _kind(file)
    if not kind:
        return nodeid
    return file if kind == "files" else kind


def _file(nodeid: str) -> str:
    return nodeid.partition("::")[0]


def _kind(file: str) -> str:
    if file == _LONG:
        return ""
    if not file.startswith(_INTEGRATION):
        return "files"
    part = file.removeprefix(_INTEGRATION).partition("/")[0]
    if part in _COMPUTING:
        return "files"
    return "jobs" if part in _JOBS else "in time"
