"""The child process that reads hostile inputs, and tells its parent what came of each.

``python -m tests.fuzz.worker ORDER``, where ORDER is JSON. Which input is being read, and its
bytes, are in a file that the parent maps too, so that whatever ends this process, a signal or the
parent's patience, the input is known.
"""

import mmap
import os
import resource
import struct
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import msgspec
import structlog

from tests.fuzz import guard, with_hypothesis
from tests.fuzz.order import Order
from tests.fuzz.registry import targets_of
from tests.fuzz.target import MIB, Target

BATCH = 32
"""Inputs between two looks at the memory."""
ADDRESS_SPACE = 1024 * MIB
"""What a process may map beyond what its libraries took; an allocation beyond it fails."""
BOX = struct.Struct("<QIQ")
BOX_BYTES = 8 * MIB
SLOW_SECONDS = 2.0
"""CPU seconds of one input; more is a defect."""


class Fault(msgspec.Struct, frozen=True, kw_only=True):
    """One broken promise."""

    target: str
    kind: str
    """``escaped``, ``memory``, ``slow``, ``acted``; of the parent: ``crashed``, ``hung``."""
    index: int
    why: str
    data: bytes


class Tally(msgspec.Struct, kw_only=True):
    """What came of the inputs of one target."""

    inputs: int = 0
    accepted: int = 0
    seconds: float = 0.0
    """CPU of the slowest."""
    memory: int = 0
    """Bytes, the most that a batch took beyond what was there."""


class Result(msgspec.Struct, kw_only=True):
    """What a child has done."""

    tallies: dict[str, Tally] = {}
    faults: list[Fault] = []
    done: int = 0


class Box:
    """The file that outlives a crash: which input is being read, and its bytes."""

    def __init__(self, path: Path) -> None:
        if not path.exists():
            path.write_bytes(bytes(BOX.size + BOX_BYTES))
        with path.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), BOX.size + BOX_BYTES)

    def put(self, index: int, which: int, data: bytes) -> None:
        """Note an input before it is read."""
        kept = data[:BOX_BYTES]
        BOX.pack_into(self._map, 0, index, which, len(kept))
        self._map[BOX.size : BOX.size + len(kept)] = kept

    def get(self) -> tuple[int, int, bytes]:
        """Return the last input, and the place of its target in the list."""
        index, which, size = BOX.unpack_from(self._map)
        return index, which, bytes(self._map[BOX.size : BOX.size + size])


class Reader:
    """Reads inputs and keeps count."""

    def __init__(self, targets: list[Target], watch: guard.Guard, box: Box) -> None:
        self.targets = targets
        self.result = Result(tallies={each.name: Tally() for each in targets})
        self._watch = watch
        self._box = box

    def read(self, which: int, index: int, data: bytes) -> None:
        """Read one input."""
        target = self.targets[which]
        tally = self.result.tallies[target.name]
        self._box.put(index, which, data)
        why = ""
        began = time.process_time()
        try:
            with self._watch.watching():
                target.read(data)
            tally.accepted += 1
        except target.refusals as error:
            if _ran_out(error) and not target.may_run_out:
                self._fault(which, index, "memory", f"refused for lack of memory: {error}", data)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            why = f"{type(error).__name__}: {error}"[:500] + _where(error)
        spent = time.process_time() - began
        tally.inputs += 1
        tally.seconds = max(tally.seconds, spent)
        if why:
            self._fault(which, index, "escaped", why, data)
        if spent > SLOW_SECONDS:
            self._fault(which, index, "slow", f"{spent:.1f} s of CPU", data)
        if self._watch.events:
            self._fault(which, index, "acted", "; ".join(self._watch.events), data)
            self._watch.events.clear()

    def one(self, which: int, data: bytes, first: int) -> None:
        """Read one input, the next after ``first`` and those that were read."""
        self.batch([(which, first + self.result.done, data)])

    def batch(self, inputs: list[tuple[int, int, bytes]]) -> None:
        """Read some, and look what memory they took; in doubt one by one."""
        before = guard.forget_peak()
        for which, index, data in inputs:
            self.read(which, index, data)
        taken = guard.peak() - before
        for which in {each[0] for each in inputs}:
            tally = self.result.tallies[self.targets[which].name]
            tally.memory = max(tally.memory, taken)
        least = min(self.targets[which].bound.of(len(data)) for which, _, data in inputs)
        if taken > least:
            for which in {each[0] for each in inputs}:  # whose it was is found out now
                self.result.tallies[self.targets[which].name].memory = 0
            for which, index, data in inputs:
                self._measure(which, index, data)
        self.result.done += len(inputs)

    def _measure(self, which: int, index: int, data: bytes) -> None:
        target = self.targets[which]
        guard.collected()
        before = guard.forget_peak()
        try:
            with self._watch.watching():
                target.read(data)
        except Exception:  # it was counted the first time
            pass
        taken = guard.peak() - before
        tally = self.result.tallies[target.name]
        tally.memory = max(tally.memory, taken)
        if taken > target.bound.of(len(data)):
            why = f"{taken / MIB:.0f} MiB for {len(data)} B"
            self._fault(which, index, "memory", why, data)

    def _fault(self, which: int, index: int, kind: str, why: str, data: bytes) -> None:
        if len(self.result.faults) < 200:
            name = self.targets[which].name
            self.result.faults.append(
                Fault(target=name, kind=kind, index=index, why=why, data=data)
            )


def turns(targets: list[Target]) -> list[tuple[int, int]]:
    """Return whose turn it is, over and over, and its how manieth: as often as its weight says."""
    return [(which, turn) for which, each in enumerate(targets) for turn in range(each.weight)]


def inputs(targets: list[Target], order: Order) -> Iterator[tuple[int, int, bytes]]:
    """Yield the inputs that a child is to read: target, number, bytes."""
    round_robin = turns(targets)
    for number in range(order.first, order.first + order.count):
        which, turn = round_robin[number % len(round_robin)]
        index = number // len(round_robin) * targets[which].weight + turn
        yield which, number, targets[which].input(order.seed, index)


def _ran_out(error: BaseException) -> bool:
    """Return whether an allocation failed behind an error."""
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, MemoryError):
            return True
        seen = seen.__cause__ or seen.__context__
    return False


def _where(error: BaseException) -> str:
    """Return the innermost places that an error came through."""
    places: list[str] = []
    trace = error.__traceback__
    while trace is not None:
        places.append(f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}")
        trace = trace.tb_next
    return " at " + " < ".join(reversed(places[-4:]))


def main(words: list[str]) -> int:
    """Do what the order says; the result is in a file that is whole or not there."""
    order = msgspec.json.decode(words[0], type=Order)
    structlog.configure(processors=[lambda *_: (_ for _ in ()).throw(structlog.DropEvent)])
    warnings.simplefilter("ignore")
    ram = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=ram if ram.is_dir() else None) as name:
        os.chdir(name)  # where libraries write logs that nobody asked for
        watch = guard.Guard(Path(name))
        targets = _targets(order, Path(name))
        reader = Reader(targets, watch, Box(Path(order.box)))
        for which, target in enumerate(targets):  # what is loaded lazily is loaded now
            reader.read(which, 0, target.samples[0])
        reader.result = Result(tallies={each.name: Tally() for each in targets})
        limit = guard.size() + ADDRESS_SPACE
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if order.engine == "atheris":
            _guided(reader, order)
        elif order.engine == "hypothesis":
            with_hypothesis.run(reader.targets, reader.one, order)
        else:
            batch: list[tuple[int, int, bytes]] = []
            for each in inputs(targets, order):
                batch.append(each)
                if len(batch) == BATCH:
                    reader.batch(batch)
                    batch = []
            if batch:
                reader.batch(batch)
        write(reader, order)
    return 0


def _guided(reader: Reader, order: Order) -> None:
    """Read what coverage leads to, all of one target."""
    from tests.fuzz import with_atheris

    def read(data: bytes) -> None:
        reader.one(0, data, order.first)
        if reader.result.done >= order.count:
            write(reader, order)
            with_atheris.leave(0)

    with_atheris.run(reader.targets[0], read, lambda: None, order.seed + order.first + 1)


def _targets(order: Order, folder: Path) -> list[Target]:
    def made() -> list[Target]:
        found = targets_of(order.group, folder, order.registry)
        return [each for each in found if order.only in ("", each.name)]

    if order.engine != "atheris":
        return made()
    import atheris

    with atheris.instrument_imports(include=["shared", "services"]):
        return made()


def write(reader: Reader, order: Order) -> None:
    """Leave the result for the parent."""
    target = Path(order.result)
    temporary = target.with_suffix(".new")
    temporary.write_bytes(msgspec.json.encode(reader.result))
    temporary.replace(target)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
