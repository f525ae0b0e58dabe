"""Names for the array types that many signatures share."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, Union

import numpy as np
from jaxtyping import Array, Float

Scalar = Float[Array, ""]
ScalarLike = Float[Array, ""] | Float[np.ndarray, ""] | float | int
Vector3 = Float[Array, "3"]
Quaternion = Float[Array, "4"]  # w, x, y, z
Matrix3 = Float[Array, "3 3"]
Axis = str | tuple | list | np.ndarray | Array  # "x", "-z", ... or three numbers
ArrayLike = Array | np.ndarray | np.generic | float | int | list | tuple  # what `jnp.asarray` takes
AnyArray = Array | np.ndarray  # what has a shape and a dtype
Number = Array | np.ndarray | np.number | float | int  # what arithmetic takes: a number, or one for each
RowsLike = Sequence[int] | np.ndarray  # numbers of rows, known before tracing
CoordinateLike = str | tuple | list | int | np.integer  # "tip z", ("tip", "z"), "tip" for all of a node, row 3
FrameLike = str | tuple | list  # the name of a body or frame, or (name, point)

T = TypeVar("T")
if TYPE_CHECKING:
    Convertible: TypeAlias = Union[T, Any]  # noqa: UP007  # a field with a converter, which takes more than it holds
    WordedError = Annotated[T, "explained"]  # an argument of which others are refused in words, not as a type
else:

    class Convertible:
        def __class_getitem__(cls, held):
            return held

    class WordedError:
        def __class_getitem__(cls, wanted):
            return Any
