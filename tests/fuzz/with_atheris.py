"""Coverage-guided fuzzing of one target; our mutators break what has reached new code."""

import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from random import Random

import atheris

from tests.fuzz import mutate
from tests.fuzz.target import Target


def run(target: Target, read: Callable[[bytes], None], end: Callable[[], None], seed: int) -> None:
    """Fuzz until ``end`` ends the process; the corpus is made of valid samples, and forgotten.

    Args:
        target: what is fuzzed; its modules were imported under ``atheris.instrument_imports``.
        read: reads one input.
        end: called when this returns, which libFuzzer does not.
        seed: of libFuzzer.
    """

    def broken(data: bytes, most: int, number: int) -> bytes:
        random = Random(number)
        try:
            return target.mutate(random, data or random.choice(target.samples))[:most]
        except Exception:  # whatever it says of what is no valid sample any more
            return mutate.raw(random, data)[:most]

    with tempfile.TemporaryDirectory() as corpus:
        for number, sample in enumerate(target.samples):
            Path(corpus, str(number)).write_bytes(sample)
        words = [sys.argv[0], f"-seed={seed}", "-rss_limit_mb=0", "-verbosity=0",
                 f"-max_len={mutate.LARGEST}", "-timeout=60", corpus]  # fmt: skip
        atheris.Setup(words, read, custom_mutator=broken)
        atheris.Fuzz()
    end()


def leave(status: int) -> None:
    """End at once: libFuzzer's own way out runs handlers that print."""
    os._exit(status)
