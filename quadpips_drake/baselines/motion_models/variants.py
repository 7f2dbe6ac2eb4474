"""What the linear models are compared with (Table I of Taouil et al.): fewer inputs, the second degree, a small network."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.fitting import LINEAR_VARIANTS, QuadraticModel, fit_quadratic, fit_variant
from quadpips_drake.baselines.motion_models.model_file import ADVICE, MAX_BYTES, arrays_in
from quadpips_drake.baselines.motion_models.small_network import LAYER_SHAPES, NetworkModel
from quadpips_drake.baselines.motion_models.state import INPUTS, OUTPUTS
from quadpips_drake.baselines.motion_models.step_data import Steps
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_bytes, write_bytes

FILE = "variants.npz"
"""Beside the files of the models; only comparisons need it."""
FULL, QUADRATIC, NETWORK = "full", "quadratic", "network"
_MOST_BYTES = 100_000


@dataclass(frozen=True, eq=False)
class ModelVariants:
    """All of them, fitted to the same steps."""

    linear: dict[str, np.ndarray]
    """Coefficients of swing 0 (OUTPUTS, INPUTS) by name, "full" among them."""
    quadratic: QuadraticModel
    network: NetworkModel

    def predictors(self) -> dict[str, Callable[[np.ndarray], np.ndarray]]:
        """By name: inputs (n, INPUTS) -> outputs (n, OUTPUTS) of swing 0."""
        linear = {name: _linear(coefficients) for name, coefficients in self.linear.items()}
        return linear | {QUADRATIC: self.quadratic.predict_first, NETWORK: self.network.predict_first}


def linear_and_quadratic(steps: Steps) -> tuple[dict[str, np.ndarray], QuadraticModel]:
    """Fits all that has a closed form."""
    return {name: fit_variant(steps, name) for name in LINEAR_VARIANTS}, fit_quadratic(steps)


def save_variants(directory: Path, variants: ModelVariants) -> None:
    """Writes FILE. Numbers that count on scaled quantities are rounded to half precision: 0.05 % of each."""
    quadratic, network = variants.quadratic, variants.network
    arrays = {
        "linear": np.stack([variants.linear[name] for name in LINEAR_VARIANTS]).astype(np.float32),
        "quadratic_scales": np.concatenate((quadratic.mean, quadratic.scale, quadratic.offset)).astype(np.float32),
        "quadratic_weights": quadratic.weights.astype(np.float16),
        "network_scales": np.concatenate(_scales(network)).astype(np.float32),
        "network_weights": np.concatenate([array.ravel() for array in network.weights]).astype(np.float16),
    }
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    write_bytes(Path(directory) / FILE, file.getvalue())


def read_variants(directory: Path) -> ModelVariants:
    """Reads them; UserInputError where they are missing or not sound."""
    try:
        arrays = arrays_in(read_bytes(Path(directory) / FILE, FILE, MAX_BYTES), FILE, _MOST_BYTES)
        arrays = {name: array.astype(float) for name, array in arrays.items()}
        linear = dict(zip(LINEAR_VARIANTS, arrays["linear"], strict=True))
        weights, scales = arrays["quadratic_weights"], arrays["quadratic_scales"]
        quadratic = QuadraticModel(*_cut(scales, [(len(weights),), (len(weights),), (OUTPUTS,)]), weights)
        scales = _cut(arrays["network_scales"], [(INPUTS - 1,), (INPUTS - 1,), (OUTPUTS,), (OUTPUTS,)])
        network = NetworkModel(*scales, tuple(_cut(arrays["network_weights"], LAYER_SHAPES)))
        variants = ModelVariants(linear, quadratic, network)
        shapes = {predict(np.zeros((1, INPUTS))).shape for predict in variants.predictors().values()}
    except UserInputError as error:
        raise UserInputError(f"motion models {directory}: {error}; {ADVICE}") from None
    except (KeyError, ValueError, TypeError):
        shapes = set()
    if shapes != {(1, OUTPUTS)}:
        raise UserInputError(f"motion models {directory}: {FILE} is damaged; {ADVICE}")
    return variants


def _cut(array: np.ndarray, shapes: list[tuple[int, ...]]) -> list[np.ndarray]:
    """The pieces of these shapes that lie one after the other in ``array``; a ValueError if it has another size."""
    sizes = [int(np.prod(shape)) for shape in shapes]
    if array.shape != (sum(sizes),):
        raise ValueError("another size")
    pieces = np.split(array, np.cumsum(sizes)[:-1])
    return [piece.reshape(shape) for piece, shape in zip(pieces, shapes, strict=True)]


def _linear(coefficients: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    return lambda x: x @ coefficients.T


def _scales(network: NetworkModel) -> tuple[np.ndarray, ...]:
    return network.input_mean, network.input_scale, network.output_mean, network.output_scale
