"""NumPy's files of anybody's making."""

import math
import tokenize
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def read_array(path: Path) -> NDArray[np.float64]:
    """Return the numbers in a ``.npy`` file; nothing in it is executed.

    A header that claims more numbers than the file has takes no memory. (NumPy's own reader
    allocates what the header claims; mapping the file, it divides by an item's size, which may be
    zero: a signal that ends the process.)

    Raises:
        OSError: it cannot be read.
        ValueError: it is no such file, or damaged, or does not hold numbers.
    """
    try:
        with path.open("rb") as file:
            if np.lib.format.read_magic(file) == (1, 0):
                shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(file)
            else:
                raise ValueError("it is a .npy file of a version that is not read, expected 1.0")
            data = file.read()
    except (TypeError, EOFError, SyntaxError, tokenize.TokenError, RecursionError) as error:
        raise ValueError(str(error) or type(error).__name__) from error
    if dtype.kind not in "fiu" or min(shape, default=0) < 0:
        raise ValueError(f"it holds {dtype} in the shape {shape}, expected numbers")
    if len(data) != math.prod(shape) * dtype.itemsize:
        raise ValueError(f"{len(data)} bytes follow a header of {dtype} in the shape {shape}")
    numbers = np.frombuffer(data, dtype).reshape(shape, order="F" if is_fortran else "C")
    return numbers.astype(np.float64)
