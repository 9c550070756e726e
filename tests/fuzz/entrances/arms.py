"""What an identification is given of somebody's robot: an MJCF file, a bag of ROS 1 or ROS 2.

Behind both are other people's parsers, MuJoCo's in C++ among them: the child that reads them is
there to be crashed.
"""

import copy
import functools
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from random import Random

from rosbags.rosbag2 import StoragePlugin

from shared.errors import IdentificationError, RiposteError
from shared.ros.bags import read_topics, topics_of
from shared.sim.hidden.arms import ARMS
from shared.sim.plant.plant import mjcf
from tests.fuzz import formats, mutate
from tests.fuzz.target import MIB, Bound, Target, from_file
from tests.integration.identification.dataset import bags

MODEL = Bound(256, 256 * MIB)
"""An MJCF may ask for memory of its own, and has it checked by MuJoCo."""
BAG = Bound(256, 96 * MIB)
ODD = (
    "", "nan", "inf", "-1", "0", "1e308", "1e-320", "9" * 400, "1 2 3 4 5 6 7 8 9", "x", "true",
    "0 0 0", "0 0 0 0", "-1e30 1e30", "1000000000", "../../etc/passwd", "\u202e", "%s%n",
)  # fmt: skip
TAGS = (
    "worldbody", "body", "joint", "freejoint", "geom", "site", "inertial", "default", "actuator",
    "motor", "position", "sensor", "keyframe", "equality", "tendon", "option", "compiler",
    "asset", "mesh", "hfield", "include", "frame", "replicate", "plugin", "x",
)  # fmt: skip


def targets(folder: Path) -> list[Target]:
    """Return all of them."""
    folder.mkdir(parents=True, exist_ok=True)
    return [*_mjcf(folder), *_bags(folder)]


def _mjcf(folder: Path) -> list[Target]:
    made: list[Target] = []
    for name, joints, control in (
        ("arm3", ("yaw", "shoulder", "elbow"), ARMS["arm3"].control),
        ("torque2", ("shoulder", "elbow"), ARMS["torque2"].control),
    ):
        file = ARMS[name].file
        assert file is not None
        path = folder / f"{name}.xml"

        def read(path: Path = path, joints=joints, control=control) -> object:
            return mjcf(path, control, joints, joints, "tool").make().compile()

        made.append(
            Target(
                name=f"arms/{name}.xml",
                read=from_file(path, read),
                samples=(file.read_bytes(),),
                mutate=_xml,
                refusals=(IdentificationError,),
                covers=("shared.sim.plant.plant:mjcf", "shared.sim.plant.plant:mjcf.<locals>.read"),
                bound=MODEL,
                weight=4,
            )
        )
    return made


def _xml(random: Random, data: bytes) -> bytes:
    """Break an MJCF: its elements, their attributes, or its bytes."""
    if random.random() < formats.RAW:
        return mutate.raw(random, data)
    root = ET.fromstring(data)
    for _ in range(random.choice((1, 1, 2, 4))):
        _change(random, root)
    text = ET.tostring(root)
    if random.random() < 0.05:
        depth = mutate.size_of(random, 1 << 12)
        text = text.replace(
            b"</worldbody>", b"<body>" * depth + b"</body>" * depth + b"</worldbody>"
        )
    return text


def _change(random: Random, root: ET.Element) -> None:
    all_of = list(root.iter())
    one = random.choice(all_of)
    way = random.randrange(7)
    if way < 3 and one.attrib:
        name = random.choice(list(one.attrib))
        one.set(name, random.choice((*ODD, random.choice(list(random.choice(all_of).attrib.values())
                                                        or [""]))))  # fmt: skip
    elif way == 3:
        one.set(random.choice(list(random.choice(all_of).attrib) or ["x"]), random.choice(ODD))
    elif way == 4 and one.attrib:
        del one.attrib[random.choice(list(one.attrib))]
    elif way == 5 and len(one):
        child = random.choice(list(one))
        if random.random() < 0.5:
            one.remove(child)
        else:
            random.choice(all_of).append(copy.deepcopy(child))
    else:
        ET.SubElement(one, random.choice(TAGS), dict(random.choice(all_of).attrib))


def _bags(folder: Path) -> list[Target]:
    """Return the targets of every kind of bag, each with a few messages of three topics."""
    samples = _samples()
    made: list[Target] = []
    for name in ("one.bag", "two.mcap", "two.db3"):
        path = folder / name
        made.append(_bag(name, path, path, samples[name]))
    whole = folder / "whole"
    whole.mkdir(exist_ok=True)
    (whole / "whole.db3").write_bytes(samples["two.db3"])
    made.append(_bag("metadata.yaml", whole / "metadata.yaml", whole, samples["metadata.yaml"]))
    return made


def _bag(name: str, file: Path, bag: Path, sample: bytes) -> Target:
    def read() -> object:
        found = topics_of(bag)
        return read_topics(bag, list(found))

    return Target(
        name=f"arms/{name}",
        read=from_file(file, read),
        samples=(sample,),
        mutate=mutate.raw,
        refusals=(RiposteError,),
        covers=("shared.ros.bags:_opened", "shared.ros.bags:read_topics"),
        bound=BAG,
        may_run_out=True,
    )


@functools.cache
def _samples() -> dict[str, bytes]:
    """Return small bags as files: of ROS 1, and of ROS 2 in both of its kinds of storage."""
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        one, two = bags.Made(1), bags.Made(2)
        made = {"one.bag": bags.write(here / "one", one, bags.moving(one, 0, seconds=0.03))}
        for plugin, end in ((StoragePlugin.MCAP, "mcap"), (StoragePlugin.SQLITE3, "db3")):
            bag = bags.write(here / end, two, bags.moving(two, 0, seconds=0.03), plugin)
            (made[f"two.{end}"],) = bag.glob(f"*.{end}")
        text = (here / "db3" / "metadata.yaml").read_text().replace("db3.db3", "whole.db3")
        return {key: path.read_bytes() for key, path in made.items()} | {
            "metadata.yaml": text.encode()
        }
