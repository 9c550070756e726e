"""The tables of ``docs/recordings.md``: streams, columns and units, from the code that has them.

``python -m shared.telemetry.columns docs/recordings.md`` renews them between their two markers.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from shared.messages.markdown import renew
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
    return 0 if renew(Path(words[0]), BEGIN, END, describe()) else 2


if __name__ == "__main__":
    sys.exit(main())
