"""`riposte certs DIR`: makes and renews the certificates of a site."""

import argparse
import datetime
import ipaddress
import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

from services.jobs.certs.folder import PRIVATE, Kept, keep
from shared.clock import Clock, SystemClock
from shared.errors import ConfigError
from shared.messages.topics import CERTIFIED

DAYS = 365
SOON_DAYS = 30
"""A certificate that expires within this is pointed out."""

_NAME = re.compile(
    r"(?=.{1,253}\Z)([A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?\.)*"
    r"[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?"
)


def main(argv: Sequence[str]) -> int:
    """Run ``riposte certs``; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="riposte certs",
        description="Makes the certificates of a site: an authority, one for its routers, one for "
        "each role. What is there is kept. Copy to a machine ca.crt and the files of the roles "
        f"that run on it, never the folder {PRIVATE}.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="where they are, or will be")
    parser.add_argument(
        "--host", action="append", default=[], metavar="NAME_OR_ADDRESS", type=check_host,
        help="where others reach a router; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--renew", action="append", default=[], choices=CERTIFIED, metavar="ROLE",
        help="make this one anew; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--days", type=int, default=DAYS, help="validity of new certificates (%(default)s)"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object")
    found = parser.parse_args(argv)
    if not 1 <= found.days <= 3650:
        raise ConfigError(f"--days is {found.days}; allowed are 1 to 3650")
    now = now_of(SystemClock())
    kept = keep(found.folder, found.host, found.renew, now, found.days)
    print(json.dumps(to_json(found.folder, kept)) if found.json else words(found.folder, kept, now))
    return 0


def check_host(text: str) -> str:
    """Return a host name, or an address as certificates write it.

    Raises:
        argparse.ArgumentTypeError: it is neither; a port or a protocol does not belong here.
    """
    try:
        return str(ipaddress.ip_address(text.strip("[]")))
    except ValueError:
        pass
    if _NAME.fullmatch(text) and not re.fullmatch(r"[\d.]+", text):
        return text.lower()
    raise argparse.ArgumentTypeError(
        f"{text!r} is no host: expected a name such as league.example.org or an address such as "
        "192.168.1.5, without protocol and port"
    )


def now_of(clock: Clock) -> datetime.datetime:
    """Return the time of a clock as a date."""
    return datetime.datetime.fromtimestamp(clock.wall_ns() // 10**9, datetime.UTC)


def words(folder: Path, kept: Sequence[Kept], now: datetime.datetime) -> str:
    """Return what is in a folder, a line each."""
    lines: list[str] = []
    for one in kept:
        left = math.ceil((one.expires - now) / datetime.timedelta(days=1))
        note = "made now" if one.is_new else "kept"
        if left < SOON_DAYS:
            do = "make a new folder" if one.role == "ca" else f"add --renew {one.role}"
            note += f", {'EXPIRED' if left <= 0 else 'expires soon'}: {do}"
        hosts = f"  for {', '.join(one.hosts)}" if one.hosts else ""
        lines.append(f"{one.role:<9} until {one.expires:%Y-%m-%d} ({left} days)  {note}{hosts}")
    lines.append(
        f'in {folder}; use it with certificates = "{folder}" in [bus], or --certificates {folder}'
    )
    return "\n".join(lines)


def to_json(folder: Path, kept: Sequence[Kept]) -> dict[str, object]:
    """Return the same in builtins; no key is in it."""
    return {
        "folder": str(folder),
        "certificates": [
            {
                "role": one.role,
                "expires": one.expires.isoformat(),
                "hosts": list(one.hosts),
                "made": one.is_new,
            }
            for one in kept
        ],
    }
