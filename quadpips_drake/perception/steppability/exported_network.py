"""The network as it runs: a graph of 8-bit integers in an ONNX file, computed by ONNX Runtime.

``learning/model_files.py`` makes the file from the trained weights. Here it is held against what such a network consists of
before anything is computed: the file may come from anywhere.
"""

import math

import numpy as np
import onnx
import onnxruntime

from quadpips_drake.perception.steppability.features import CHANNELS

CLASSES = ("steppable", "passable", "non_passable")
"""In the order of the logits; class k is Steppability k + 1."""
STRIDE = 16
"""Sides of the network's input are multiples of this [pixels]."""
FOLD = 2
"""Logits come folded: those of FOLD x FOLD pixels lie in channels, so that nothing runs at full resolution."""
INPUT, OUTPUT = "features", "logits"
_OPERATORS = frozenset(
    ("Add", "Concat", "Conv", "DequantizeLinear", "GlobalAveragePool", "QuantizeLinear", "Relu", "Resize")
)
"""All that the network is made of: nothing that repeats, branches, or reads other files."""
_PROBE = (240, 320)
"""Size of the image for which the memory that a file asks for is added up [pixels]."""
_MAX_ELEMENTS = 100_000_000
"""Most numbers in all intermediate results for it; the shipped network has 8 million."""


class ExportedNetwork:
    """Computes logits from features, on the calling thread alone and without Python's lock."""

    def __init__(self, content: bytes):
        """``content``: of an ONNX file; a ValueError if that is damaged or no such network."""
        try:
            _check(onnx.load_model_from_string(content))
            options = onnxruntime.SessionOptions()
            # Beside a simulation, threads that wait for each other cost more than they bring.
            options.intra_op_num_threads = options.inter_op_num_threads = 1
            options.log_severity_level = 4  # what is wrong comes as an exception
            self._session = onnxruntime.InferenceSession(
                content, options, providers=["CPUExecutionProvider"], enable_fallback=0
            )
            logits = self(np.zeros((len(CHANNELS), STRIDE, STRIDE), np.float32))
        except Exception as error:  # parser, shape inference and runtime have types of their own, without a common base
            raise ValueError(f"not a steppability network: {error}") from None
        if logits.shape != (FOLD**2 * len(CLASSES), STRIDE // FOLD, STRIDE // FOLD) or not np.isfinite(logits).all():
            raise ValueError("not a steppability network: its output is another one")

    def __call__(self, features: np.ndarray) -> np.ndarray:
        """Returns logits, float32 (FOLD^2 len(CLASSES), height/FOLD, width/FOLD).

        Channel FOLD^2 k + FOLD i + j holds class k of the pixels (FOLD r + i, FOLD c + j).

        Args:
            features: float32 (len(CHANNELS), height, width), multiples of STRIDE.
        """
        return self._session.run([OUTPUT], {INPUT: features[None]})[0][0]


def padded(features: np.ndarray) -> np.ndarray:
    """Returns ``features`` with zeros (nothing measured) at right and bottom, so that sides are multiples of STRIDE."""
    missing = [-side % STRIDE for side in features.shape[1:]]
    return np.pad(features, [(0, 0), *((0, count) for count in missing)]) if any(missing) else features


def _check(model: onnx.ModelProto) -> None:
    """Raises something unless ``model`` consists of the network's operators, finite numbers, and results of bounded size."""
    graph = model.graph
    unknown = {node.op_type for node in graph.node if node.op_type not in _OPERATORS or node.domain}
    if unknown or model.functions or graph.sparse_initializer:
        raise ValueError(f"has other operators: {sorted(unknown)}")
    for tensor in graph.initializer:
        if tensor.data_location == onnx.TensorProto.EXTERNAL:
            raise ValueError("has numbers in other files")
        numbers = onnx.numpy_helper.to_array(tensor)
        # A NaN would be in all logits, and what comes of it is no label.
        if numbers.dtype.kind not in "fiu" or not np.isfinite(numbers).all():
            raise ValueError(f"{tensor.name} is not finite")
    for dimension, size in zip(graph.input[0].type.tensor_type.shape.dim, (1, len(CHANNELS), *_PROBE), strict=True):
        dimension.dim_value = size
    del graph.value_info[:]  # what the file itself says about sizes
    for dimension in graph.output[0].type.tensor_type.shape.dim:
        dimension.Clear()
    inferred = onnx.shape_inference.infer_shapes(model, check_type=True, strict_mode=True, data_prop=True).graph
    sizes = {value.name: _size(value) for value in (*inferred.value_info, *inferred.output)}
    if sum(sizes[name] for node in graph.node for name in node.output) > _MAX_ELEMENTS:
        raise ValueError("asks for too much memory")


def _size(value: onnx.ValueInfoProto) -> int:
    """Number of elements; a ValueError if it is not known."""
    dimensions = [dimension.dim_value for dimension in value.type.tensor_type.shape.dim]
    if any(size <= 0 for size in dimensions):
        raise ValueError(f"the size of {value.name} is not known")
    return math.prod(dimensions)
