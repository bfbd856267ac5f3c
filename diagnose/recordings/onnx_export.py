"""A trained network as an ONNX file that takes windows in m/s2, checked against torch as soon as it is written."""

from __future__ import annotations

import contextlib
import copy
import io
import json
import logging
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.nn.functional import log_softmax

from diagnose.data.windows import normalised
from diagnose.networks.registry import input_of
from gensig.errors import ConfigError, GensigError
from gensig.version import __version__

if TYPE_CHECKING:
    from diagnose.training.store import ModelDescription

INPUT, OUTPUT = "acceleration", "log_probability"
TOLERANCE = 1e-4  # of a log-probability, and this share of it
N_CHECKED = 6


class RawWindows(nn.Module):
    """A network with what its windows are normalised by: windows in m/s2 in, log-probabilities of the classes out."""

    def __init__(self, model: nn.Module, normalise: str) -> None:
        super().__init__()
        self.model, self.normalise = model, normalise

    def forward(self, acceleration: torch.Tensor) -> torch.Tensor:
        """(window, class) of (window, channel, sample), as `diagnose.data.windows.normalised` and the network."""
        return log_softmax(self.model(without_level(acceleration, self.normalise)), dim=1)


def without_level(acceleration: torch.Tensor, normalise: str) -> torch.Tensor:
    """`diagnose.data.windows.normalised` of (window, channel, sample), as a graph."""
    windows = acceleration - acceleration.mean(dim=-1, keepdim=True)
    if normalise != "rms":
        return windows
    level = (windows * windows).mean(dim=-1, keepdim=True).sqrt()
    return windows / torch.where(level > 0, level, torch.ones_like(level))


class EqualParts(nn.Module):
    """Mean or maximum over parts as of torch's adaptive pooling, for one length: ONNX has no operator that does it."""

    def __init__(self, n_samples: int, n_parts: int, *, maximum: bool) -> None:
        super().__init__()
        self.parts = [(i * n_samples // n_parts, -(-(i + 1) * n_samples // n_parts)) for i in range(n_parts)]
        self.maximum = maximum

    def forward(self, maps: torch.Tensor) -> torch.Tensor:
        """(window, channel, part) of (window, channel, sample)."""
        cut = [maps[..., first:last] for first, last in self.parts]
        return torch.stack([part.amax(dim=-1) if self.maximum else part.mean(dim=-1) for part in cut], dim=-1)


def need_packages() -> None:
    """Refuse to go on without the packages of the extra ``onnx``."""
    try:
        import onnx  # noqa: F401
        import onnxruntime  # noqa: F401
        import onnxscript  # noqa: F401
    except ImportError as error:
        raise ConfigError(f"export --to onnx needs the package {error.name}: pip install 'gensig[onnx]'") from None


def export_onnx(model: nn.Module, description: ModelDescription, file: Path) -> float:
    """Write the file, check it, and return the largest difference of a log-probability from torch's.

    Parameters
    ----------
    model, description : of `diagnose.training.store.load_model`
    file : must not exist; what the numbers mean goes into its metadata

    Raises
    ------
    ConfigError    for a model that looks at turns, or without the packages of the extra ``onnx``
    GensigError    for a network that cannot be written, or whose file does not answer like torch; no file is left
    """
    if reason := input_of(description.model).why_not_exported:
        raise ConfigError(reason)
    need_packages()
    whole = RawWindows(with_fixed_pooling(model, description), description.normalise).eval()
    examples = raw_examples(model, description)
    try:
        write_onnx(whole, {INPUT: torch.from_numpy(examples[:2])}, OUTPUT, file)
        describe_onnx(file, description, _facts(description))
        difference = largest_difference(model, description, file)
    except BaseException:
        file.unlink(missing_ok=True)
        raise
    if not difference <= TOLERANCE:
        file.unlink()
        raise GensigError(
            f"{file} answered unlike torch by {difference:.2g} of a log-probability, at most {TOLERANCE:g} is allowed; "
            "it was removed"
        )
    return difference


def largest_difference(model: nn.Module, description: ModelDescription, file: Path) -> float:
    """Largest difference of a log-probability, or its share where that is greater than 1, on windows of many levels.

    Torch gets what `diagnose predict` gives it, windows normalised outside the network; the file gets m/s2.
    """

    examples = raw_examples(model, description)
    with torch.inference_mode():
        windows = torch.from_numpy(normalised(examples, description.normalise))
        expected = log_softmax(model.eval()(windows), dim=1).numpy().astype(float)
    found = answers_of(file, {INPUT: examples}, OUTPUT)
    return float(np.max(np.abs(found - expected) / np.maximum(np.abs(expected), 1.0)))


def answers_of(file: Path, inputs: Mapping[str, NDArray[np.float32]], output: str) -> NDArray[np.float64]:
    """What onnxruntime makes of inputs (window, ...), in blocks of two sizes."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
    blocks = [{name: values[part] for name, values in inputs.items()} for part in (slice(0, 1), slice(1, None))]
    return np.concatenate([session.run([output], block)[0] for block in blocks]).astype(float)


def write_onnx(whole: nn.Module, inputs: Mapping[str, torch.Tensor], output: str, file: Path) -> None:
    """Write a network whose inputs (window, ...) have these names.

    Raises
    ------
    GensigError    for a network that cannot be written
    """
    said = io.StringIO()
    loggers = [logging.getLogger(name) for name in ("torch.onnx", "onnxscript", "onnx_ir")]
    before = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.ERROR)
        with warnings.catch_warnings(), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            warnings.simplefilter("ignore")
            torch.onnx.export(
                whole,
                tuple(inputs.values()),
                str(file),
                input_names=list(inputs),
                output_names=[output],
                dynamic_shapes={name: {0: torch.export.Dim("window", min=1)} for name in inputs},
                dynamo=True,
                external_data=False,
                verbose=False,
            )
    except Exception as error:  # torch raises whatever stopped it
        reason = " ".join(str(error).split())[:160]
        raise GensigError(f"this network cannot be written as ONNX: {reason}") from None
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _facts(description: ModelDescription) -> dict[str, Any]:
    """What is told of a classifier's answers."""
    return {
        "class_names": list(description.class_names),
        "temperature": description.temperature,
        "probability": "softmax over classes of the mean log_probability over the windows of a record / temperature",
    }


def describe_onnx(file: Path, description: ModelDescription, answers: Mapping[str, Any]) -> None:
    """What the numbers mean, as text and JSON in the file's metadata; ``answers`` what is told of the output."""
    import onnx

    facts = {
        "producer": f"gensig {__version__}",
        **answers,
        "channel_names": list(description.channel_names),
        "unit": "m/s2",
        "sampling_rate_hz": description.sampling_rate_hz,
        "window_samples": description.window_samples,
        "stride_samples": description.stride_samples,
        "normalise": f"{description.normalise}, inside the graph",
        "n_teeth": description.n_teeth,
        "speed_rpm_range": description.speed_rpm_range,
        "protocol": description.protocol,
        "seed": description.seed,
        "data_fingerprint": description.data_fingerprint,
    }
    content = onnx.load(file)
    del content.metadata_props[:]
    for key, value in facts.items():
        content.metadata_props.add(key=key, value=value if isinstance(value, str) else json.dumps(value))
    onnx.checker.check_model(content)
    onnx.save(content, file)


def raw_examples(model: nn.Module, description: ModelDescription) -> NDArray[np.float32]:
    """(window, channel, sample) m/s2: noise and tones beside an offset, and a silent channel.

    Levels go from a tenth to ten times what the network divides its input by, the RMS of its training.
    """
    rng = np.random.default_rng(0)
    shape = (N_CHECKED, len(description.channel_names), description.window_samples)
    time = np.arange(description.window_samples)
    tones = np.sin(2 * np.pi * rng.uniform(0.001, 0.4, shape[:2])[..., None] * time)
    typical = model.get_buffer("input_scale").numpy()  # (channel, 1)
    level = np.geomspace(0.1, 10.0, N_CHECKED)[:, None, None] * typical
    windows = level * (rng.standard_normal(shape) + 2.0 * tones + 0.5)
    windows[-1, 0] = 0.0
    return windows.astype(np.float32)


def with_fixed_pooling(model: nn.Module, description: ModelDescription) -> nn.Module:
    """A copy whose adaptive poolings are those of the windows' length."""
    fixed = copy.deepcopy(model).eval()
    pools = {
        name: module
        for name, module in fixed.named_modules()
        if isinstance(module, nn.AdaptiveAvgPool1d | nn.AdaptiveMaxPool1d)
    }
    lengths: dict[nn.Module, int] = {}

    def measure(module: nn.Module, given: tuple[torch.Tensor, ...], _: torch.Tensor) -> None:
        lengths[module] = int(given[0].shape[-1])

    hooks = [module.register_forward_hook(measure) for module in pools.values()]
    try:
        with torch.inference_mode():
            fixed(torch.zeros(1, len(description.channel_names), description.window_samples))
    except RuntimeError:
        raise GensigError("this network does not take windows of acceleration; it cannot be written as ONNX") from None
    for hook in hooks:
        hook.remove()
    for name, module in pools.items():
        n_parts = module.output_size if isinstance(module.output_size, int) else module.output_size[0]
        parent, _, last = name.rpartition(".")
        parts = EqualParts(lengths[module], int(n_parts), maximum=isinstance(module, nn.AdaptiveMaxPool1d))
        setattr(fixed.get_submodule(parent), last, parts)
    return fixed
