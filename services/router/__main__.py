"""``python -m services.router [SITE] [--listen tcp/127.0.0.1:PORT]``."""

import argparse
import sys
import threading
from collections.abc import Sequence

from services.router.service import run
from shared.bus.config import BusConfig
from shared.runtime.serve import ServeArgs, serve_plain


def main(argv: Sequence[str] | None = None) -> int:
    """Run the router until it is told to stop; return the exit code."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--listen", action="append", default=[])
    own, rest = parser.parse_known_args(sys.argv[1:] if argv is None else argv)

    def body(args: ServeArgs, stop: threading.Event) -> None:
        cfg = args.section("bus", BusConfig)
        run(cfg.with_endpoints(connect=args.connect, listen=tuple(own.listen)), stop)

    return serve_plain("router", body, rest)


if __name__ == "__main__":
    sys.exit(main())
