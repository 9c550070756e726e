"""`riposte identify DATASET`: find what the simulation gets wrong, name it, write what follows.

Writes ``verdict.json``, ``report.html``, ``recording.rrd`` and the extended model into a folder
beside the data set. Subcommands make data sets and plan recordings.
"""

import argparse
import dataclasses
import importlib
import os
import shlex
import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from services.jobs.identify.outputs import Made, write_all
from services.jobs.identify.progress import StepDisplay
from services.jobs.identify.words import verdict_text
from shared.clock import SystemClock
from shared.config.site import nearest
from shared.errors import ConfigError
from shared.identification.arm.subject import plant_of
from shared.identification.catalogue import effects
from shared.identification.dataset.caveats import in_words
from shared.identification.dataset.followed import MIXED_UP
from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Dataset
from shared.identification.find import identify
from shared.runtime.files import RunLock, require_free_space

FREE_BYTES = 64 << 20
LARGEST_SEED = 2**31 - 1
THREADS, MOST_THREADS = 8, 256
"""That simulate unless it is said, at most: a few dozen arms are simulated at once."""
STEPS_FOLDER = "steps"
"""In the output folder: what each finished step found, for ``--resume``."""


class Subcommand(NamedTuple):
    """``add_arguments(parser)`` and ``run(arguments)`` in ``services.jobs.identify.<module>``."""

    name: str
    module: str
    about: str


SUBCOMMANDS = (
    Subcommand("excite", "excite", "design the motions to record, within the safety limits"),
    Subcommand("simulate", "simulate", "write a data set with hidden effects"),
    Subcommand("from-bouts", "from_bouts", "write a data set from the bouts of a recorder"),
    Subcommand("import-bag", "import_bag", "write a data set from ROS bags"),
)
_BY_NAME = {subcommand.name: subcommand for subcommand in SUBCOMMANDS}


def main(argv: Sequence[str]) -> int:
    """Run ``riposte identify`` or one of its subcommands; return the exit code."""
    if argv and argv[0] in _BY_NAME:
        return _subcommand(_BY_NAME[argv[0]], argv[1:])
    found = _parse(argv)
    _check_effects(found.without)
    dataset = _dataset(found.dataset, found.model)
    plant_of(dataset)  # refuses models that do not fit, before there is a folder
    out = _out_folder(found.dataset, found.out)
    display = StepDisplay(SystemClock())
    with RunLock(out):
        require_free_space(out, FREE_BYTES)
        steps = out / STEPS_FOLDER
        if not found.resume and steps.exists():
            shutil.rmtree(steps)
        steps.mkdir(exist_ok=True)
        display.say(opening(dataset, out))
        try:
            with display:
                finding = identify(
                    dataset,
                    seed=found.seed,
                    progress=display,
                    resume_folder=steps,
                    without=tuple(found.without),
                    threads=found.threads,
                )
        except KeyboardInterrupt:
            words = [*argv, *([] if found.resume else ["--resume"])]
            display.say(f"continue with: {shlex.join(['riposte', 'identify', *words])}")
            raise
        made = Made(
            dataset=dataset,
            name=found.dataset.resolve().name,
            command=shlex.join(["riposte", "identify", *_told(argv)]),
        )
        write_all(out, finding.verdict, finding.evidence, made)
    if found.json:
        print(msgspec.json.encode(finding.verdict).decode())
    else:
        print(verdict_text(finding.verdict, out))
    return 0


def _subcommand(subcommand: Subcommand, argv: Sequence[str]) -> int:
    module = importlib.import_module(f"services.jobs.identify.{subcommand.module}")
    add_arguments: Callable[[argparse.ArgumentParser], None] = module.add_arguments
    run: Callable[[argparse.Namespace], int] = module.run
    parser = argparse.ArgumentParser(
        prog=f"riposte identify {subcommand.name}", description=module.__doc__
    )
    add_arguments(parser)
    return run(parser.parse_args(argv))


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    others = "\n".join(f"  {each.name:<12} {each.about}" for each in SUBCOMMANDS)
    parser = argparse.ArgumentParser(
        prog="riposte identify",
        description="Find what a simulation gets wrong about measured data, name the cause, and "
        "write a report and the extended model.",
        epilog=f"subcommands:\n{others}\n\nA data set in a folder of such a name: "
        "riposte identify ./simulate",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("dataset", type=Path, metavar="DATASET", help="folder with dataset.toml")
    parser.add_argument(
        "--model", type=Path, metavar="M",
        help="compare with another model than the data set names: a model.toml, or an MJCF file",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder to write (identify-NAME beside DATASET)"
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="S", help="of everything random (%(default)s)"
    )
    parser.add_argument("--json", action="store_true", help="print the verdict as JSON")
    parser.add_argument(
        "--resume", action="store_true", help="go on where it was stopped, with the same options"
    )
    parser.add_argument(
        "--without", nargs="+", action="extend", default=[], metavar="EFFECT",
        help="leave effects of the catalogue out",
    )  # fmt: skip
    most = len(os.sched_getaffinity(0))
    parser.add_argument(
        "--threads", type=int, default=min(most, THREADS), metavar="N",
        help=f"that simulate; what is found does not depend on it (the cores there are, up to "
        f"{THREADS}: %(default)s)",
    )  # fmt: skip
    found = parser.parse_args(argv)
    if not 1 <= found.threads <= MOST_THREADS:
        raise ConfigError(f"--threads is {found.threads}; allowed are 1 to {MOST_THREADS}")
    if not 0 <= found.seed <= LARGEST_SEED:
        raise ConfigError(f"--seed is {found.seed}; allowed are 0 to {LARGEST_SEED}")
    return found


def _check_effects(names: Sequence[str]) -> None:
    """Check that the catalogue has effects of these names.

    Raises:
        ConfigError: it has not; names the nearest.
    """
    known = [effect.name for effect in effects()]
    for name in names:
        if name not in known:
            raise ConfigError(f"--without {name}: there is no such effect; {nearest(name, known)}")


def _dataset(folder: Path, model: Path | None) -> Dataset:
    """Return the data set, with another model where one was asked for.

    Raises:
        RiposteError: it cannot be used.
    """
    dataset = read_dataset(folder)
    if model is None:
        return dataset
    is_file = model.is_file()
    source = dataset.source
    if source.kind == "pr2":
        if str(model) == "nominal":
            return dataclasses.replace(dataset, source=dataclasses.replace(source, parameters=None))
        if not is_file or model.suffix != ".toml":
            raise ConfigError(
                f'--model {model}: this data set is of a PR2 and needs a model.toml or "nominal"'
            )
        return dataclasses.replace(dataset, source=dataclasses.replace(source, parameters=model))
    if not is_file:
        raise ConfigError(f"--model {model}: there is no such MJCF file")
    return dataclasses.replace(dataset, source=dataclasses.replace(source, path=model))


def _out_folder(dataset: Path, out: Path | None) -> Path:
    """Return where to write.

    Raises:
        ConfigError: that is the data set itself, or a file.
    """
    whole = dataset.resolve()
    folder = whole.parent / f"identify-{whole.name}" if out is None else out
    if folder.resolve() == whole:
        raise ConfigError(f"--out {folder} is the data set itself; choose another folder")
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--out {folder} is a file; choose a folder")
    return folder


def opening(dataset: Dataset, out: Path) -> str:
    """Return what is going to be worked on, and what is better mended before that."""
    train, test = len(dataset.train), len(dataset.test)
    repeats = len(dataset.trajectories) - train - test
    again = f" ({repeats} repeated)" if repeats else ""
    seconds = sum(each.duration for each in dataset.trajectories)
    first = (
        f"{len(dataset.joints)} joints, {train} recordings to fit and {test} held out{again}, "
        f"{seconds:.0f} s in all; writes to {out}"
    )
    names = sorted({each.name for each in dataset.caveats})
    limits = [f"caveats: {', '.join(names)}"] if names else []
    mixed = in_words([each for each in dataset.caveats if each.name in MIXED_UP])
    return "\n".join([first, *limits, *(f"beware: {each}" for each in mixed)])


def _told(argv: Sequence[str]) -> list[str]:
    """Return a command line without the places of this machine: their last names stay."""
    return [Path(word).name if word.startswith("/") else word for word in argv]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
