"""What an ONNX file may hold to be opened: the few operations of our networks, and all of its numbers inside it.

A graph of other operations may loop without end or load code, and numbers may be kept in another file, anywhere on the
disk. Only the names are read here, from the bytes of the file, so that the package ``onnx`` is not needed.
"""

from collections.abc import Iterator
from pathlib import Path

from dnnvss.errors import DnnvssError

OPERATIONS = frozenset({
    "Abs", "Add", "And", "Cast", "CastLike", "Ceil", "Clip", "Concat", "Constant", "ConstantOfShape", "Conv", "Div",
    "Einsum", "Elu", "Equal", "Erf", "Exp", "Expand", "Flatten", "Floor", "GRU", "Gather", "GatherElements",
    "GatherND", "Gelu", "Gemm", "Greater", "GreaterOrEqual", "Identity", "LSTM", "LayerNormalization", "LeakyRelu",
    "Less", "LessOrEqual", "Log", "LogSoftmax", "MatMul", "Max", "Mean", "Min", "Mod", "Mul", "Neg", "Not",
    "Or", "Pad", "Pow", "Range", "Reciprocal", "ReduceMax", "ReduceMean", "ReduceMin", "ReduceSum", "Relu", "Reshape",
    "Selu", "Shape", "Sigmoid", "Sign", "Size", "Slice", "Softmax", "Softplus", "Split", "Sqrt", "Squeeze",
    "Sub", "Sum", "Tanh", "Tile", "Transpose", "Unsqueeze", "Where"})
"""Operations of ONNX that take tensors and give tensors, and nothing else."""
_REMEDY = "Export the run again: dnnvss export RUN"

_GRAPH, _FUNCTIONS = 7, 25  # of a model
_NODE, _INITIALIZER, _SPARSE = 1, 5, 15  # of a graph
_OPERATION, _ATTRIBUTE, _DOMAIN = 4, 5, 7  # of a node
_TENSOR, _INNER, _TENSORS, _INNERS = 5, 6, 10, 11  # of an attribute
_EXTERNAL, _LOCATION = 13, 14  # of a tensor
"""Numbers of the fields in ``onnx.proto``."""


def check_graph(path: Path) -> None:
    """Refuse a file that does more than a network of ours.

    Raises:
        DnnvssError: another operation, a graph inside the graph, functions, numbers in other files, or no ONNX at all.
    """
    data = memoryview(path.read_bytes())
    try:
        for field, value in _fields(data):
            if field == _FUNCTIONS:
                raise _refused(path, "functions")
            if field == _GRAPH:
                _check(value, path)
    except (IndexError, TypeError, UnicodeDecodeError) as error:
        raise DnnvssError("is no ONNX file, or was cut short", file=path, remedy=_REMEDY) from error


def _check(graph: memoryview, path: Path) -> None:
    for field, value in _fields(graph):
        if field == _SPARSE:
            raise _refused(path, "sparse numbers")
        if field == _INITIALIZER:
            _check_tensor(value, path)
        if field == _NODE:
            _check_node(value, path)


def _check_node(node: memoryview, path: Path) -> None:
    for field, value in _fields(node):
        if field == _OPERATION and (name := bytes(value).decode()) not in OPERATIONS:
            raise _refused(path, f"the operation {name!r}")
        if field == _DOMAIN and bytes(value) not in (b"", b"ai.onnx"):
            raise _refused(path, f"operations of {bytes(value).decode()!r}")
        if field == _ATTRIBUTE:
            for inner, part in _fields(value):
                if inner in (_INNER, _INNERS):
                    raise _refused(path, "a graph inside its graph")
                if inner in (_TENSOR, _TENSORS):
                    _check_tensor(part, path)


def _check_tensor(tensor: memoryview, path: Path) -> None:
    if any(field == _EXTERNAL or (field == _LOCATION and value) for field, value in _fields(tensor)):
        raise _refused(path, "numbers in another file")


def _refused(path: Path, what: str) -> DnnvssError:
    return DnnvssError(f"holds {what}, which no network of this package has", file=path, remedy=_REMEDY)


def _fields(data: memoryview) -> Iterator[tuple[int, memoryview]]:
    """The fields of a message of protocol buffers: number and content; a whole number has none where it is zero.

    Raises:
        IndexError: the message is cut short or damaged.
    """
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        kind = key & 7
        if kind == 0:
            value, end = _varint(data, at)
            start, at = (at if value else end), end
        elif kind == 2:
            length, start = _varint(data, at)
            at = start + length
        elif kind in (1, 5):
            start, at = at, at + (8 if kind == 1 else 4)
        else:
            raise IndexError(kind)
        if at > len(data):
            raise IndexError(at)
        yield key >> 3, data[start:at]


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            return value, at
        if shift > 63:
            raise IndexError(at)
