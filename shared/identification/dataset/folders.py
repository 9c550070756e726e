"""Folders that appear whole or not at all, and what their manifests say of the model."""

import contextlib
import os
import shutil
from collections.abc import Generator
from pathlib import Path
from typing import Any

from shared.errors import IdentificationError
from shared.identification.dataset.types import ModelSource
from shared.runtime.files import sync_folder


@contextlib.contextmanager
def whole_folder(folder: Path) -> Generator[Path, None, None]:
    """Give a folder to write into, which takes its place once everything is in it.

    Args:
        folder: absolute; must not exist, or be empty.

    Raises:
        IdentificationError: it is not empty, or cannot be written.
    """
    temporary = folder.with_name(f".{folder.name}.{os.getpid()}.tmp")
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise IdentificationError(f"{folder} is already there: name a new folder")
        temporary.mkdir(parents=True)
        yield temporary
        os.replace(temporary, folder)
        sync_folder(folder.parent)
    except OSError as error:
        raise IdentificationError(f"cannot write {folder}: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            shutil.rmtree(temporary)


def model_table(source: ModelSource, folder: Path) -> dict[str, Any]:
    """Return the manifest's ``[model]``; files are named by their way from the folder."""
    model: dict[str, Any] = {"kind": source.kind}
    if source.kind == "pr2":
        model["arm"] = source.arm
    for key, path in (("path", source.path), ("parameters", source.parameters)):
        if path is not None:
            model[key] = os.path.relpath(path.absolute(), folder)
    if source.tracked:
        model["tracked"] = source.tracked
    if source.encoders is not None:
        model["encoders"] = source.encoders
    return model
