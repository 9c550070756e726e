"""`riposte sim export`: the simulated robots as a MuJoCo file for others to build on."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from shared.config.site import load_section
from shared.sim.config import SimConfig
from shared.sim.export import export_mjcf


def main(argv: Sequence[str]) -> int:
    """Run ``riposte sim``; return the exit code."""
    parser = argparse.ArgumentParser(prog="riposte sim", description=__doc__)
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    export = actions.add_parser("export", help="write the scene as one MJCF file")
    export.add_argument("site", nargs="?", type=Path, metavar="SITE", help="site file (TOML)")
    export.add_argument("--out", type=Path, required=True, metavar="F.xml", help="file to write")
    export.add_argument(
        "--single", action="store_true", help="one arm with its bat, not two robots"
    )
    export.add_argument(
        "--set", action="append", default=[], metavar="sim.KEY=VALUE", dest="overrides",
        help="over the site file; may be repeated",
    )  # fmt: skip
    found = parser.parse_args(argv)
    cfg = load_section(found.site, "sim", SimConfig, found.overrides)
    export_mjcf(found.out, found.single, cfg)
    print(f"wrote {found.out}")
    return 0
