"""Names for the array types that the signatures of this project use."""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
IntArray = NDArray[np.int64]
Int32Array = NDArray[np.int32]
UIntArray = NDArray[np.uint64]
BoolArray = NDArray[np.bool_]
ByteArray = NDArray[np.uint8]
AnyArray = NDArray[Any]
_Array = TypeVar("_Array", bound=AnyArray)


def read_only(array: _Array) -> _Array:
    """The array itself, which nobody may write to from now on."""
    array.flags.writeable = False
    return array
