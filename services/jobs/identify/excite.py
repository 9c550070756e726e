"""Design the motions to record, within the safety limits, and say what they will show.

Writes a folder that is a data set but for what the robot logs: ``dataset.toml``, a
``command.parquet`` for each recording, ``programme.toml`` and a picture. Before that it says how
far each effect of the catalogue would stand out of the noise and which would be confused, and
refuses programmes that show too little. ``--check`` says the same of recordings that are there.
"""

import argparse
import json
import math
import textwrap
from pathlib import Path
from typing import Any

from services.jobs.identify.words import WIDTH, sizes_text
from services.jobs.robot.playable import tool_limits
from services.robot_io.config import SafetyConfig
from shared.config.site import load_section
from shared.errors import ConfigError, IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.catalogue import effects
from shared.identification.dataset.reading import read_dataset
from shared.identification.excitation.arm import Arm, mjcf_arm, pr2_arm
from shared.identification.excitation.limits import ToolLimits
from shared.identification.excitation.prediction import (
    Outlook,
    Prediction,
    assumed_noise,
    predict,
)
from shared.identification.excitation.programme import SHOWS, Programme, design
from shared.identification.excitation.writing import write_programme
from shared.identification.fitting.problem import BLOCK
from shared.identification.noise.floor import noise_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel

EXIT_REFUSED = 2
MOST_PAIRS = 12
"""Of effects that look alike: so many are printed, all are written."""
ASSUMED = (
    "assumed: joints repeat to 0.3 mrad, a tracker to 0.9 mm; with twice as much it takes twice "
    "the sizes below (--check goes by the repeat that was recorded)"
)
LARGEST_SEED = 2**31 - 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument(
        "robot", nargs="?", default="pr2", metavar="ROBOT",
        help="pr2, or an MJCF file (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write (excite-ROBOT)")
    parser.add_argument(
        "--check", type=Path, metavar="DATASET", help="say what recordings show, and write nothing"
    )
    parser.add_argument(
        "--seconds", type=float, default=75.0, metavar="T", help="of all motion (%(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="(%(default)s)")
    parser.add_argument(
        "--safe-box", type=float, nargs=6, metavar="M",
        help="where the tool stays: lowest x y z, then highest (m); the site's for a PR2",
    )  # fmt: skip
    parser.add_argument(
        "--site", type=Path, metavar="SITE", help="site file: its [safety] holds for a PR2"
    )
    parser.add_argument("--arm", choices=("right", "left"), default="right", help="of a PR2")
    parser.add_argument("--model", type=Path, metavar="M", help="model.toml of a PR2")
    parser.add_argument(
        "--control", choices=("position", "torque"), help="of an MJCF (what its actuators take)"
    )
    parser.add_argument(
        "--tracked", default="", metavar="NAME", help="site or body of an MJCF with the tracker"
    )
    parser.add_argument(
        "--joint-speed", type=float, default=1.5, metavar="V",
        help="of an MJCF's fastest joint (%(default)s rad/s)",
    )  # fmt: skip
    parser.add_argument(
        "--require", type=float, default=0.6, metavar="SHARE",
        help="refuse if fewer of the effects would be seen (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print what is seen as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Design a programme, or check recordings; return the exit code."""
    if not 0.0 <= arguments.require <= 1.0:
        raise ConfigError(f"--require is {arguments.require}; allowed are 0 to 1")
    if not 0 <= arguments.seed <= LARGEST_SEED:
        raise ConfigError(f"--seed is {arguments.seed}; allowed are 0 to {LARGEST_SEED}")
    if arguments.check is not None:
        return _check(arguments)
    folder: Path = arguments.out or Path(f"excite-{Path(arguments.robot).stem}")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise IdentificationError(f"{folder} is already there: name a new folder with --out")
    programme = design(_arm(arguments), arguments.seconds, arguments.seed)
    prediction = predict(
        programme.predicted, assumed_noise(len(programme.predicted.joints)), effects()
    )
    print(_json(prediction) if arguments.json else _text(prediction, programme))
    if (code := _verdict(prediction, arguments.require)) != 0:
        print("nothing was written; --seconds, --safe-box or --require decide otherwise")
        return code
    generator = {
        "command": "riposte identify excite",
        "robot": Path(arguments.robot).name,
        "seconds": arguments.seconds,
        "seed": arguments.seed,
    }
    write_programme(programme, prediction, folder, generator, _picture(programme, prediction))
    if not arguments.json:
        print(f"\nwrote {folder}: play each command.parquet, and put what is logged beside it")
    return 0


def _arm(arguments: argparse.Namespace) -> Arm:
    box: list[float] | None = arguments.safe_box
    if box is not None and not all(low < high for low, high in zip(box[:3], box[3:], strict=True)):
        raise ConfigError(f"--safe-box is {box}; the lowest x y z come first, then the highest")
    if arguments.robot != "pr2":
        tool = None
        if box is not None:
            tool = ToolLimits((box[0], box[1], box[2]), (box[3], box[4], box[5]))
        return mjcf_arm(
            Path(arguments.robot), arguments.control, arguments.tracked, arguments.joint_speed, tool
        )
    overrides: list[str] = []
    if box is not None:
        overrides = [f"safety.box_low={box[:3]}", f"safety.box_high={box[3:]}"]
    safety = load_section(arguments.site, "safety", SafetyConfig, overrides)
    model = FencingModel.build(SimConfig(arms=(arguments.arm, arguments.arm)))
    return pr2_arm(arguments.arm, arguments.model, tool_limits(safety, model))


def _check(arguments: argparse.Namespace) -> int:
    dataset = read_dataset(arguments.check)
    noise = noise_of(dataset, BLOCK, subject_of(dataset).starts)
    prediction = predict(dataset, noise, effects())
    print(_json(prediction) if arguments.json else _text(prediction, None))
    if not noise.is_measured and not arguments.json:
        print("no recording repeats another: the noise is a guess, and so are all sizes")
    return _verdict(prediction, arguments.require)


def _verdict(prediction: Prediction, require: float) -> int:
    """Return the exit code, and say why where it is not 0."""
    if prediction.share >= require:
        return 0
    able = [outlook for outlook in prediction.outlooks if outlook.powers]
    seen = sum(outlook.is_visible for outlook in able)
    print(
        f"refused: {seen} of {len(able)} effects would be seen, "
        f"fewer than the {100 * require:.0f} % that --require asks for"
    )
    return EXIT_REFUSED


def _text(prediction: Prediction, programme: Programme | None) -> str:
    lines: list[str] = []
    if programme is not None:
        lines += [*_programme_lines(programme), *textwrap.wrap(ASSUMED, WIDTH)]
    lines += ["", f"{'effect':<22}{'seen at':<10}{'named from about':<31}looked at with"]
    for outlook in prediction.outlooks:
        lines.append(_outlook_line(outlook))
    lines.append(
        "seen: named nine times of ten at the size looked at, beside a base that is fitted"
    )
    if prediction.pairs:
        lines += ["", "would be confused (alike to):"]
        for pair in prediction.pairs[:MOST_PAIRS]:
            lines.append(f"  {pair.cosine:.3f}  {pair.first.label}  |  {pair.second.label}")
        if (more := len(prediction.pairs) - MOST_PAIRS) > 0:
            lines.append(f"  and {more} pairs more")
    return "\n".join(lines)


def _programme_lines(programme: Programme) -> list[str]:
    lines = [f"{'recording':<14}{'time':>7}  {'effort':>6}  {'lead':>7}   shows"]
    for part, effort, lead in zip(programme.parts, programme.effort, programme.lead, strict=True):
        shows = f"again {part.plan.repeats}" if part.plan.repeats else SHOWS[part.plan.kind]
        held_out = " (held out)" if part.plan.split == "test" else ""
        lines.append(
            f"{part.plan.name:<14}{part.at[-1]:>5.1f} s  {100 * effort.max():>4.0f} %"
            f"  {1000 * lead[0]:>4.0f} mm   {shows}{held_out}"
        )
    lines.append(
        f"{programme.seconds:.0f} s in all, effort of the joint that is closest to its limit"
    )
    return lines


def _outlook_line(outlook: Outlook) -> str:
    if not outlook.powers:
        return f"{outlook.effect:<22}{'-':<10}cannot sit on this arm, or is fitted anyway"
    worst = outlook.powers[0]
    seen = sum(power.is_visible for power in outlook.powers)
    places = f"{seen} of {len(outlook.powers)}"
    mark = "" if outlook.is_visible else "   NOT SEEN"
    at = sizes_text(worst.quantity, worst.unit, worst.size)
    at += f" at {worst.place}" if worst.place else ""
    sizes = sorted({each.named_from for each in outlook.powers if math.isfinite(each.named_from)})
    named = "at no size"
    if sizes:
        named = sizes_text(worst.quantity, worst.unit, *sizes[:1], *sizes[1:][-1:])
    return f"{outlook.effect:<22}{places:<10}{named:<31}{at}{mark}"


def _json(prediction: Prediction) -> str:
    found: dict[str, Any] = {
        "share": prediction.share,
        "effects": {
            outlook.effect: {
                "visible": outlook.is_visible,
                "places": {
                    power.place: {
                        "signal_to_noise": power.ratio,
                        "named_from": power.named_from if math.isfinite(power.named_from) else None,
                        "unit": power.unit,
                    }
                    for power in outlook.powers
                },
            }
            for outlook in prediction.outlooks
        },
        "alike": [[pair.first.label, pair.second.label, pair.cosine] for pair in prediction.pairs],
    }
    return json.dumps(found)


def _picture(programme: Programme, prediction: Prediction) -> bytes:
    from shared.telemetry.excitation_figures import Bar, Stretch, programme_picture

    dataset = programme.predicted
    stretches = [
        Stretch(each.name, each.command_at, each.command, each.split == "test")
        for each in dataset.trajectories
    ]
    labels = {"pose": "tool (m)", "position": "joints (rad, m)", "torque": "torques (N m, N)"}
    columns = dataset.actuators[:3] if dataset.control == "pose" else dataset.actuators
    bars = [
        Bar(
            outlook.effect,
            [power.size / power.named_from for power in outlook.powers],
            outlook.is_visible,
        )
        for outlook in prediction.outlooks
        if outlook.powers
    ]
    return programme_picture(stretches, columns, labels[dataset.control], bars)
