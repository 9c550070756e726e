"""``python -m services.router [SITE] [--listen tls/0.0.0.0:7447] [--print-config]``."""

import argparse
import sys
import threading
from collections.abc import Sequence

from services.router.service import run
from shared.bus.config import BusConfig, router_json
from shared.clock import SystemClock
from shared.runtime.serve import ServeArgs, parse_args, serve_plain


def main(argv: Sequence[str] | None = None) -> int:
    """Run the router until it is told to stop, or print what zenohd needs; return the exit code.

    Raises:
        ConfigError: the configuration to print is not one.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--listen", action="append", default=[])
    parser.add_argument("--print-config", action="store_true")
    own, rest = parser.parse_known_args(sys.argv[1:] if argv is None else argv)

    def config(args: ServeArgs) -> BusConfig:
        cfg = args.section("bus", BusConfig)
        return cfg.with_endpoints(connect=args.connect, listen=tuple(own.listen))

    if own.print_config:
        sys.stdout.write(router_json(config(parse_args("router", rest))) + "\n")
        return 0

    def body(args: ServeArgs, stop: threading.Event) -> None:
        run(config(args), stop, SystemClock(), args.name, args.log_path)

    return serve_plain("router", body, rest)


if __name__ == "__main__":
    sys.exit(main())
