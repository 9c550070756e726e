"""Stage `find`: name what the recordings say of the nominal model, and write both models."""

import contextlib
import io
from collections.abc import Callable

import msgspec

from services.jobs.identify import command
from services.jobs.identify.outputs import VERDICT_FILE
from shared.errors import IdentificationError
from shared.identification.conclusion.model_file import model_file
from shared.identification.dataset.reading import read_dataset
from shared.identification.verdict import Verdict
from shared.runtime.files import atomic_write
from studies.closing_the_loop.protocol import Folders, Protocol, need

Say = Callable[[str], None]


def find(protocol: Protocol, folders: Folders, say: Say) -> None:
    """Run `riposte identify`, and write the base fit without its causes beside its model."""
    base = folders.found / "base_fit.toml"
    if base.exists():
        return
    need(folders.dataset / "dataset.toml", "record")
    words = [str(folders.dataset), "--out", str(folders.found), "--resume"]
    with contextlib.redirect_stdout(io.StringIO()) as told:
        if command.main(words) != 0:
            raise IdentificationError("riposte identify did not come to a verdict")
    say(told.getvalue().strip())
    verdict = verdict_of(folders)
    alone = msgspec.structs.replace(verdict, causes=())
    made = model_file(read_dataset(folders.dataset), alone)
    atomic_write(base, made.text.encode())


def verdict_of(folders: Folders) -> Verdict:
    """Return what was found.

    Raises:
        ConfigError: nothing was looked for yet.
    """
    path = need(folders.found / VERDICT_FILE, "find")
    return msgspec.json.decode(path.read_bytes(), type=Verdict)
