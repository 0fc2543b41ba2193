"""The layers of a network, computed by NumPy.

Shapes: D numbers of an input, H of a memory.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


def times(matrix: Array, x: Array) -> Array:
    """Multiply, not by BLAS, whose threads would cost a small product more than they save, and might sum otherwise.

    Args:
        matrix: (out, in).
        x: (in,).

    Returns:
        (out,) the product, summed in one order.
    """
    return np.einsum("ij,j->i", matrix, x)


def _elu(x: Array) -> Array:
    return np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0)))


def _sigmoid(x: Array) -> Array:
    return np.float32(0.5) * (np.tanh(np.float32(0.5) * x) + np.float32(1.0))


ACTIVATIONS: dict[str, Callable[[Array], Array]] = {
    "ELU": _elu,
    "LeakyReLU": lambda x: np.where(x > 0.0, x, np.float32(0.01) * x),
    "ReLU": lambda x: np.maximum(x, np.float32(0.0)),
    "SiLU": lambda x: x * _sigmoid(x),
    "Sigmoid": _sigmoid,
    "Tanh": np.tanh,
}


class Layer(NamedTuple):
    """A linear map.

    Attributes:
        weight: (out, in).
        bias: (out,).
    """

    weight: Array
    bias: Array

    def __call__(self, x: Array) -> Array:
        return times(self.weight, x) + self.bias


class Cell(NamedTuple):
    """A layer of long short-term memory as torch has it: four gates, in, forget, cell, out.

    Attributes:
        given: from the input, (4H, D).
        fed_back: from the last output, (4H, H).

    References:
        Hochreiter & Schmidhuber 1997, Neural Computation 9, 1735-1780.
    """

    given: Layer
    fed_back: Layer

    def __call__(self, x: Array, h: Array, c: Array) -> tuple[Array, Array]:
        gate_in, forget, cell, out = np.split(self.given(x) + self.fed_back(h), 4)
        c = _sigmoid(forget) * c + _sigmoid(gate_in) * np.tanh(cell)
        return _sigmoid(out) * np.tanh(c), c
