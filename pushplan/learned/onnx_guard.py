"""Looks through an ONNX file before any library reads it.

A few hundred bytes of ONNX can ask a runtime to read other files, to run an operator of somebody's
own, or to loop. This module reads the protobuf structure by itself (the fields of `onnx.proto` that
matter, https://github.com/onnx/onnx/blob/main/onnx/onnx.proto) and lets through plain feed-forward
networks that are complete in their file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

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

_FIELDS = {
    "model": {7: "graph", 8: "opset", 14: "metadata", 20: "training", 25: "function"},
    "opset": {1: "domain"},
    "metadata": {1: "key", 2: "value"},
    "graph": {1: "node", 5: "tensor", 15: "sparse"},
    "node": {4: "operator", 5: "attribute", 7: "domain"},
    "attribute": {5: "tensor", 6: "inner", 10: "tensor", 11: "inner", 22: "inner", 23: "inner"},
    "tensor": {1: "sides", 8: "name", 13: "external", 14: "location"},
}
"""Of each message: numbers of the fields that matter. A field called like a message holds one."""
_EXTERNAL = "it keeps weights in another file (external data): save the model in one file"
_REFUSED = {
    "training": "it holds functions or training graphs, which are not run here",
    "function": "it holds functions or training graphs, which are not run here",
    "sparse": "it holds sparse tensors, which are not run here",
    "inner": "a node holds a graph or a sparse tensor, which are not run here",
    "external": _EXTERNAL,
}
_VARINT = 0
_BYTES = 2
_FIXED = {1: 8, 5: 4}
"""Wire types of protobuf with a fixed size: bytes of each."""


class NotOnnxError(InvalidInputError):
    """A file is no ONNX network, or one that is not run here."""


def inspect(data: bytes) -> dict[str, str]:
    """Check a model and give its metadata, key-value texts.

    Raises:
        NotOnnxError: if it is empty, truncated, no ONNX, or asks for what a policy does not need:
            data in other files, operators outside `OPERATORS`, control flow, functions, training
            graphs, tensors of more than `GREATEST_TENSOR` elements.
    """
    if not data:
        raise NotOnnxError("the file is empty")
    if len(data) > GREATEST_FILE:
        raise NotOnnxError(f"the file has {len(data)} bytes, {GREATEST_FILE} are the limit")
    counts = Counter[str]()
    metadata = dict[str, str]()
    _look_through("model", data, counts, metadata)
    if counts["graph"] != 1 or not counts["node"]:
        raise NotOnnxError("it is no ONNX model: it holds no graph")
    return metadata


def _look_through(kind: str, data: bytes, counts: Counter[str], metadata: dict[str, str]) -> None:
    """Check a message and all that it holds; counts messages by kind and collects metadata."""
    counts[kind] += 1
    if counts["node"] > _MOST_NODES:
        raise NotOnnxError(f"it has more than {_MOST_NODES} nodes")
    texts = dict[str, str]()
    elements = 1
    for number, value in _fields(data):
        name = _FIELDS[kind].get(number, "")
        if name in _REFUSED:
            raise NotOnnxError(_REFUSED[name])
        if name in _FIELDS:
            _look_through(name, _message(value), counts, metadata)
        elif name == "sides":
            for size in [value] if isinstance(value, int) else _varints(value):
                elements *= size
                if size >= 2**63 or elements > GREATEST_TENSOR:
                    raise NotOnnxError(
                        f"tensor {texts.get('name', '')!r:.60} is larger than {GREATEST_TENSOR} "
                        "elements"
                    )
        elif name == "location":
            if value != 0:
                raise NotOnnxError(_EXTERNAL)
        elif name:
            texts[name] = _message(value).decode("utf-8", errors="replace")
    if kind == "metadata":
        metadata[texts.get("key", "")] = texts.get("value", "")
    domain = texts.get("domain", "")
    foreign = domain not in ("", "ai.onnx")
    if kind == "opset" and foreign:
        raise NotOnnxError(f"it uses operators of domain {domain!r:.60}; only ONNX's own are run")
    operator = texts.get("operator", "")
    if kind == "node" and (foreign or operator not in OPERATORS):
        name = f"{domain}.{operator}" if domain else operator
        raise NotOnnxError(
            f"it uses the operator {name!r:.80}, which is not run here: custom operators, control "
            "flow and random numbers have no place in a policy file"
        )


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Number and value of each field of a protobuf message."""
    at = 0
    end = len(data)
    while at < end:
        key, at = _varint(data, at)
        number = key >> 3
        kind = key & 7
        if number == 0:
            raise NotOnnxError("it is no ONNX model, or damaged")
        if kind == _VARINT:
            value, at = _varint(data, at)
            yield number, value
            continue
        if kind == _BYTES:
            size, at = _varint(data, at)
        elif kind in _FIXED:
            size = _FIXED[kind]
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
