"""The tables of ``docs/recordings.md``: streams, columns and units, from the code that has them.

``python -m shared.telemetry.columns docs/recordings.md`` renews them between their two markers.
"""

import sys
from collections.abc import Sequence

from shared.messages.markdown import renew_main
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
    return renew_main("shared.telemetry.columns", BEGIN, END, describe, argv)


if __name__ == "__main__":
    sys.exit(main())
