"""What is fuzzed: an entrance for foreign bytes, valid inputs of it, and how they are broken."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from random import Random

MIB = 1 << 20
KIB = 1 << 10

Mutator = Callable[[Random, bytes], bytes]


@dataclasses.dataclass(frozen=True)
class Bound:
    """Memory that one input may take: ``multiple`` times its size, and ``constant`` more."""

    multiple: int
    constant: int
    """Bytes; what a process allocates and keeps is in it, so never less than some MiB."""

    def of(self, size: int) -> int:
        """Return the most bytes that an input of ``size`` bytes may take."""
        return self.multiple * size + self.constant


@dataclasses.dataclass(frozen=True)
class Target:
    """One entrance."""

    name: str
    """``wire/Rollout``: its group, and what of it."""
    read: Callable[[bytes], object]
    """What Riposte does with the bytes, to the last of them."""
    samples: tuple[bytes, ...]
    """Valid inputs."""
    mutate: Mutator
    """Breaks a sample in a way that gets past the first checks."""
    refusals: tuple[type[Exception], ...]
    """The documented errors; anything else that escapes is a defect."""
    covers: tuple[str, ...]
    """``module:qualname`` of the functions that meet the bytes; a test looks whether they do."""
    bound: Bound = Bound(64, 32 * MIB)
    may_run_out: bool = False
    """Whether it may be refused because memory was asked for that is not there: somebody else's
    reader takes a length at its word before it looks for the bytes. What is taken is bounded."""
    weight: int = 1
    """Inputs of this target for one of another target of its group."""

    @property
    def group(self) -> str:
        return self.name.partition("/")[0]

    def input(self, seed: int, index: int) -> bytes:
        """Return input number ``index`` of a campaign: the same for the same seed, everywhere."""
        if index < len(self.samples):
            return self.samples[index]
        random = Random(f"{seed}/{self.name}/{index}")
        return self.mutate(random, random.choice(self.samples))


def from_file(path: Path, read: Callable[[], object]) -> Callable[[bytes], object]:
    """Return a reader of bytes from a reader of a file."""

    def reader(data: bytes) -> object:
        path.write_bytes(data)
        return read()

    path.parent.mkdir(parents=True, exist_ok=True)
    return reader
