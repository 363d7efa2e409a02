"""Looks through an ONNX file before any library reads it.

A few hundred bytes of ONNX can ask a runtime to read other files, to run an operator of somebody's
own, or to loop. This module reads the protobuf structure by itself (the fields of `onnx.proto` that
matter, https://github.com/onnx/onnx/blob/main/onnx/onnx.proto) and lets through plain feed-forward
networks that are complete in their file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from pushplan.world import InvalidInputError

OPERATORS = frozenset(
    """
    Abs Add And ArgMax ArgMin AveragePool BatchNormalization Cast CastLike Ceil Celu Clip Concat
    Constant Conv ConvTranspose Cos DepthToSpace Div Dropout Elu Equal Erf Exp Flatten Floor
    Gather GatherElements Gelu Gemm GlobalAveragePool GlobalMaxPool Greater GreaterOrEqual
    GroupNormalization HardSigmoid HardSwish Identity InstanceNormalization LayerNormalization
    LeakyRelu Less LessOrEqual Log LogSoftmax LpNormalization MatMul Max MaxPool Mean Min Mish Mul
    Neg Not Or PRelu Pow Reciprocal ReduceL2 ReduceLogSumExp ReduceMax ReduceMean ReduceMin
    ReduceProd ReduceSum ReduceSumSquare Relu Reshape Resize Round Selu Shape Sigmoid Sign Sin
    Slice Softmax Softplus Softsign SpaceToDepth Split Sqrt Squeeze Sub Sum Tan Tanh Transpose
    Unsqueeze Where
    """.split()
)
"""Without control flow, random numbers, text, and what makes tensors of any size out of nothing."""


GREATEST_FILE = 64 * 2**20
"""Bytes."""
GREATEST_TENSOR = 64 * 2**20
"""Elements that a tensor of the file may have."""
_MOST_NODES = 20_000

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_MODEL = {"producer": 2, "graph": 7, "opset": 8, "metadata": 14, "training": 20, "functions": 25}
_GRAPH = {"node": 1, "initializer": 5, "sparse": 15}
_NODE = {"attribute": 5, "operator": 4, "domain": 7}
_ATTRIBUTE = {"tensor": 5, "graph": 6, "tensors": 10, "graphs": 11, "sparse": 22, "sparses": 23}
_TENSOR = {"dims": 1, "name": 8, "external": 13, "location": 14}


class NotOnnxError(InvalidInputError):
    """A file is no ONNX network, or one that is not run here."""


@dataclass
class OnnxContents:
    """What was found."""

    metadata: dict[str, str] = field(default_factory=dict)  # the model's own key-value texts
    operators: set[str] = field(default_factory=set)  # names of the operators that it uses
    opset: int = 0  # version of the operator set
    nodes: int = 0


def inspect(data: bytes) -> OnnxContents:
    """Check a model and read its metadata.

    Raises:
        NotOnnxError: if it is empty, truncated, no ONNX, or asks for what a policy does not need:
            data in other files, operators outside `OPERATORS`, control flow, functions, training
            graphs, tensors of more than `GREATEST_TENSOR` elements.
    """
    if not data:
        raise NotOnnxError("the file is empty")
    if len(data) > GREATEST_FILE:
        raise NotOnnxError(f"the file has {len(data)} bytes, {GREATEST_FILE} are the limit")
    contents = OnnxContents()
    graphs = 0
    for number, value in _fields(data):
        if number == _MODEL["graph"]:
            graphs += 1
            _graph(_message(value), contents)
        elif number == _MODEL["opset"]:
            _opset(_message(value), contents)
        elif number == _MODEL["metadata"]:
            entry = dict(_fields(_message(value)))
            contents.metadata[_text(entry.get(1, b""))] = _text(entry.get(2, b""))
        elif number in (_MODEL["training"], _MODEL["functions"]):
            raise NotOnnxError("it holds functions or training graphs, which are not run here")
    if graphs != 1 or not contents.nodes:
        raise NotOnnxError("it is no ONNX model: it holds no graph")
    return contents


def _opset(data: bytes, contents: OnnxContents) -> None:
    entry = dict(_fields(data))
    domain = _text(entry.get(1, b""))
    if domain not in ("", "ai.onnx"):
        raise NotOnnxError(f"it uses operators of domain {domain!r:.60}; only ONNX's own are run")
    version = entry.get(2, 0)
    contents.opset = version if isinstance(version, int) else 0


def _graph(data: bytes, contents: OnnxContents) -> None:
    for number, value in _fields(data):
        if number == _GRAPH["node"]:
            contents.nodes += 1
            if contents.nodes > _MOST_NODES:
                raise NotOnnxError(f"it has more than {_MOST_NODES} nodes")
            _node(_message(value), contents)
        elif number == _GRAPH["initializer"]:
            _tensor(_message(value))
        elif number == _GRAPH["sparse"]:
            raise NotOnnxError("it holds sparse tensors, which are not run here")


def _node(data: bytes, contents: OnnxContents) -> None:
    operator, domain = "", ""
    for number, value in _fields(data):
        if number == _NODE["operator"]:
            operator = _text(value)
        elif number == _NODE["domain"]:
            domain = _text(value)
        elif number == _NODE["attribute"]:
            _attribute(_message(value))
    if domain not in ("", "ai.onnx") or operator not in OPERATORS:
        name = f"{domain}.{operator}" if domain else operator
        raise NotOnnxError(
            f"it uses the operator {name!r:.80}, which is not run here: custom operators, control "
            "flow and random numbers have no place in a policy file"
        )
    contents.operators.add(operator)


def _attribute(data: bytes) -> None:
    for number, value in _fields(data):
        if number in (_ATTRIBUTE["tensor"], _ATTRIBUTE["tensors"]):
            _tensor(_message(value))
        elif number in (
            *(_ATTRIBUTE["graph"], _ATTRIBUTE["graphs"]),
            *(_ATTRIBUTE["sparse"], _ATTRIBUTE["sparses"]),
        ):
            raise NotOnnxError("a node holds a graph or a sparse tensor, which are not run here")


def _tensor(data: bytes) -> None:
    count, name = 1, ""
    for number, value in _fields(data):
        if number == _TENSOR["external"] or (number == _TENSOR["location"] and value != 0):
            raise NotOnnxError(
                "it keeps weights in another file (external data): save the model in one file"
            )
        if number == _TENSOR["name"]:
            name = _text(value)
        elif number == _TENSOR["dims"]:
            for size in [value] if isinstance(value, int) else _varints(value):
                count *= size
                if size >= 2**63 or count > GREATEST_TENSOR:
                    raise NotOnnxError(
                        f"tensor {name!r:.60} is larger than {GREATEST_TENSOR} elements"
                    )


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Number and value of each field of a protobuf message."""
    at, end = 0, len(data)
    while at < end:
        key, at = _varint(data, at)
        number, kind = key >> 3, key & 7
        if number == 0:
            raise NotOnnxError("it is no ONNX model, or damaged")
        if kind == _VARINT:
            value, at = _varint(data, at)
            yield number, value
            continue
        if kind == _BYTES:
            size, at = _varint(data, at)
        elif kind in (_FIXED32, _FIXED64):
            size = 4 if kind == _FIXED32 else 8
        else:
            raise NotOnnxError("it is no ONNX model, or damaged")
        if at + size > end:
            raise NotOnnxError("it is truncated, or no ONNX model")
        yield number, data[at : at + size]
        at += size


def _varint(data: bytes, at: int) -> tuple[int, int]:
    result = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise NotOnnxError("it is truncated, or no ONNX model")
        byte = data[at]
        at += 1
        result |= (byte & 0x7F) << shift
        if byte < 0x80:
            return result, at
    raise NotOnnxError("it is no ONNX model, or damaged")


def _varints(data: bytes) -> Iterator[int]:
    at = 0
    while at < len(data):
        value, at = _varint(data, at)
        yield value


def _message(value: int | bytes) -> bytes:
    if isinstance(value, int):
        raise NotOnnxError("it is no ONNX model, or damaged")
    return value


def _text(value: int | bytes) -> str:
    return _message(value).decode("utf-8", errors="replace")
