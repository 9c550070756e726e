"""The topic table of ``docs/architecture.md``, from the code that declares it.

``python -m shared.messages.table --check docs/architecture.md`` fails when the table there is
out of date, ``--write`` renews it between its two markers.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from shared.errors import RiposteError
from shared.messages.markdown import renewed
from shared.messages.topics import KIB, MIB, SERVICES, TOPICS, Service, Topic

BEGIN = "<!-- topics:begin -->"
END = "<!-- topics:end -->"

_HEAD = (
    "| Key | Message | How | Up to | From | To | What |",
    "|---|---|---|---|---|---|---|",
)


def table() -> str:
    """Return the Markdown table of every topic and service."""
    return "\n".join((*_HEAD, *map(_topic_row, TOPICS), *map(_service_row, SERVICES)))


def _topic_row(topic: Topic[Any]) -> str:
    return _row(
        topic.key, topic.message.__name__, topic.qos.value, _size(topic.max_bytes),
        ", ".join(topic.writers), ", ".join(topic.readers), topic.about,
    )  # fmt: skip


def _service_row(service: Service[Any, Any]) -> str:
    return _row(
        service.key,
        f"{service.request.__name__} → {service.reply.__name__}",
        "request, acknowledged" if service.acked else "request",
        f"{_size(service.max_bytes)} → {_size(service.max_reply_bytes)}",
        ", ".join(service.askers), service.answerer, service.about,
    )  # fmt: skip


def _row(key: str, message: str, *rest: str) -> str:
    return "| " + " | ".join((f"`{key}`", message, *rest)) + " |"


def _size(size: int) -> str:
    return f"{size // MIB} MiB" if size >= MIB else f"{size // KIB} KiB"


def main(argv: Sequence[str] | None = None) -> int:
    """Check or renew the table in a document; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m shared.messages.table", description=__doc__)
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--check", type=Path, metavar="FILE")
    action.add_argument("--write", type=Path, metavar="FILE")
    args = parser.parse_args(argv)
    path: Path = args.check or args.write
    try:
        old = path.read_text("utf-8")
        new = renewed(old, BEGIN, END, table())
        if args.write and new != old:
            path.write_text(new, "utf-8")
    except (OSError, UnicodeDecodeError, RiposteError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        sys.stderr.write(f"{path}: {reason}\n")
        return 2
    if args.check and new != old:
        sys.stderr.write(
            f"{path}: the topic table is out of date; run python -m shared.messages.table "
            f"--write {path}\n"
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
