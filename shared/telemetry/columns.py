"""The tables of ``docs/recordings.md``: streams, columns and units, from the code that has them.

``python -m shared.telemetry.columns docs/recordings.md`` renews them between their two markers.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from shared.errors import RiposteError
from shared.messages.markdown import renewed
from shared.telemetry.streams import DTYPES, STREAMS

BEGIN = "<!-- columns:begin -->"
END = "<!-- columns:end -->"


def describe() -> str:
    """Return the streams and their columns as Markdown tables."""
    parts: list[str] = []
    for stream in STREAMS:
        rate = f"{stream.rate_hz:g} Hz" if stream.rate_hz else "as it comes"
        parts += [f"### {stream.name}", f"{stream.about[0].upper()}{stream.about[1:]}; {rate}.", ""]
        parts += ["| Column | Unit | Type | What |", "|---|---|---|---|"]
        for column in stream.columns:
            width = f"[{column.width}]" if column.width else ""
            kind = DTYPES[column.kind].name if column.kind != "text" else "string"
            unit = column.unit or "-"
            parts.append(f"| `{column.name}` | {unit} | {kind}{width} | {column.about} |")
        parts.append("")
    return "\n".join(parts).rstrip()


def main(argv: Sequence[str] | None = None) -> int:
    """Renew the tables in a document; return the exit code."""
    words = sys.argv[1:] if argv is None else argv
    if len(words) != 1:
        sys.stderr.write("usage: python -m shared.telemetry.columns FILE\n")
        return 2
    path = Path(words[0])
    try:
        old = path.read_text("utf-8")
        new = renewed(old, BEGIN, END, describe())
        if new != old:
            path.write_text(new, "utf-8")
    except (OSError, UnicodeDecodeError, RiposteError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        sys.stderr.write(f"{path}: {reason}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
