"""Export of a trained network as an ONNX file that takes m/s^2, checked against torch."""

from __future__ import annotations

import contextlib
import copy
import io
import json
import logging
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.data.windows import normalised
from diagnose.recordings.stored_network import StoredNetwork
from gensig.errors import ConfigError, GensigError
from gensig.text.installation import install
from gensig.version import __version__

if TYPE_CHECKING:
    from diagnose.training.store import ModelDescription

INPUT = "acceleration"
N_CHECKED = 6  # windows
LOGGERS = ("torch.onnx", "onnxscript", "onnx_ir")
TOLERANCE = 1e-4  # of an answer, and this share of it where that is above 1


def need_packages() -> None:
    """Refuse to go on without the packages of the extra ``onnx``."""
    try:
        import onnx  # noqa: F401
        import onnxruntime  # noqa: F401
        import onnxscript  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            f"export --to onnx needs the package {error.name}: {install('onnx')}",
        ) from None


def export_onnx(network: StoredNetwork, file: Path) -> str:
    """Write the file, check it, and return in words how well it agrees with torch.

    Parameters
    ----------
    network : of `diagnose.recordings.registry.open_network`
    file : must not exist; what the numbers mean goes into its metadata

    Raises
    ------
    ConfigError    for a model whose input no graph makes, or without the packages of ``onnx``
    GensigError    for a network that cannot be written, or whose file does not answer like torch;
        no file is left
    """
    description = network.description
    if reason := network.inputs().why_not_exported:
        raise ConfigError(reason)
    need_packages()
    graph = network.graph()
    windows = raw_examples(network.model, description)
    inputs = {INPUT: windows, **graph.further}
    two = {name: torch.from_numpy(values[:2]) for name, values in inputs.items()}
    fixed = with_fixed_pooling(network.model, *two.values())
    whole = RawWindows(fixed, description.normalise, graph.answer, graph.unit).eval()
    try:
        write_onnx(whole, two, graph.output, file)
        describe_onnx(file, description, graph.facts)
        result = answers_of(file, inputs, graph.output) / graph.unit
        taken = (normalised(windows, description.normalise), *graph.further.values())
        with torch.inference_mode():
            answer = graph.answer(network.model, *map(torch.from_numpy, taken))
        expected = answer.numpy().astype(float)
        error = np.abs(result - expected) / np.maximum(np.abs(expected), 1.0)
        difference = float(np.max(error))
        if not difference <= TOLERANCE:
            raise GensigError(
                f"{file} answered unlike torch by {difference:.2g} of {graph.unit_text}, "
                f"at most {TOLERANCE:g} is allowed; it was removed"
            )
    except BaseException:
        file.unlink(missing_ok=True)
        raise
    return graph.agreement.format(difference)


def answers_of(
    file: Path,
    inputs: Mapping[str, NDArray[np.float32]],
    output: str,
) -> NDArray[np.float64]:
    """Answers of onnxruntime to inputs (window, ...), in blocks of two sizes."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(
        str(file), options, providers=["CPUExecutionProvider"]
    )
    answers = []
    for part in (slice(0, 1), slice(1, None)):
        block = {name: values[part] for name, values in inputs.items()}
        answers.append(session.run([output], block)[0])
    return np.concatenate(answers).astype(float)


def write_onnx(
    whole: nn.Module,
    inputs: Mapping[str, torch.Tensor],
    output: str,
    file: Path,
) -> None:
    """Write a network whose inputs (window, ...) have these names.

    Raises
    ------
    GensigError    for a network that cannot be written
    """
    shapes = ({0: torch.export.Dim("window", min=1)},) * len(inputs)
    try:
        with _silent():
            torch.onnx.export(
                whole,
                tuple(inputs.values()),
                str(file),
                input_names=list(inputs),
                output_names=[output],
                dynamic_shapes=(shapes,),
                dynamo=True,
                external_data=False,
                verbose=False,
            )
    except Exception as error:  # torch raises whatever stopped it
        reason = " ".join(str(error).split())[:160]
        raise GensigError(f"this network cannot be written as ONNX: {reason}") from None


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """No output of the exporters: no lines, no warnings, of their loggers errors only."""
    output = io.StringIO()
    loggers = [logging.getLogger(name) for name in LOGGERS]
    before = [logger.level for logger in loggers]
    with (
        warnings.catch_warnings(),
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(output),
    ):
        warnings.simplefilter("ignore")
        for logger in loggers:
            logger.setLevel(logging.ERROR)
        try:
            yield
        finally:
            for logger, level in zip(loggers, before, strict=True):
                logger.setLevel(level)


def describe_onnx(
    file: Path, description: ModelDescription, answers: Mapping[str, Any]
) -> None:
    """Write the meaning of the numbers, as text and JSON, into the file's metadata.

    Parameters
    ----------
    answers : facts of the output
    """
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
        if not isinstance(value, str):
            value = json.dumps(value)
        content.metadata_props.add(key=key, value=value)
    onnx.checker.check_model(content)
    onnx.save(content, file)


class RawWindows(nn.Module):
    """A network behind the normalisation of its windows, as one graph.

    Parameters
    ----------
    model : of normalised windows
    normalise : as in `diagnose.data.windows.Task`
    answer, unit : of `diagnose.recordings.stored_network.Graph`
    """

    def __init__(
        self,
        model: nn.Module,
        normalise: str,
        answer: Callable[..., torch.Tensor],
        unit: float,
    ) -> None:
        super().__init__()
        self.model, self.normalise = model, normalise
        self.answer, self.unit = answer, unit

    def forward(self, *inputs: torch.Tensor) -> torch.Tensor:
        """Answer in its unit for (window, channel, sample) in m/s^2 and further inputs."""
        acceleration, *further = inputs
        windows = without_level(acceleration, self.normalise)
        return self.unit * self.answer(self.model, windows, *further)


def without_level(acceleration: torch.Tensor, normalise: str) -> torch.Tensor:
    """`diagnose.data.windows.normalised` of (window, channel, sample), as a graph."""
    windows = acceleration - acceleration.mean(dim=-1, keepdim=True)
    if normalise != "rms":
        return windows
    level = (windows * windows).mean(dim=-1, keepdim=True).sqrt()
    return windows / torch.where(level > 0, level, torch.ones_like(level))


class EqualParts(nn.Module):
    """Mean or maximum over parts as of torch's adaptive pooling, for one length.

    ONNX has no operator that does it.
    """

    def __init__(self, n_samples: int, n_parts: int, *, maximum: bool) -> None:
        super().__init__()
        self.parts = [
            slice(i * n_samples // n_parts, -(-(i + 1) * n_samples // n_parts))
            for i in range(n_parts)
        ]
        self.reduce = torch.amax if maximum else torch.mean

    def forward(self, maps: torch.Tensor) -> torch.Tensor:
        """(window, channel, part) of (window, channel, sample)."""
        reduced = [self.reduce(maps[..., part], dim=-1) for part in self.parts]
        return torch.stack(reduced, dim=-1)


def raw_examples(
    model: nn.Module, description: ModelDescription
) -> NDArray[np.float32]:
    """(window, channel, sample) m/s2: noise and tones beside an offset, and a silent channel.

    Levels go from a tenth to ten times what the network divides its input by, the RMS of its
    training.
    """
    rng = np.random.default_rng(0)
    shape = (N_CHECKED, len(description.channel_names), description.window_samples)
    time = np.arange(description.window_samples)
    tones = np.sin(2 * np.pi * rng.uniform(0.001, 0.4, shape[:2])[..., None] * time)
    scales = [
        value for name, value in model.named_buffers() if name.endswith("input_scale")
    ]
    typical = scales[0].numpy()  # (channel, 1)
    level = np.geomspace(0.1, 10.0, N_CHECKED)[:, None, None] * typical
    windows = level * (rng.standard_normal(shape) + 2.0 * tones + 0.5)
    windows[-1, 0] = 0.0
    return windows.astype(np.float32)


def with_fixed_pooling(model: nn.Module, *inputs: torch.Tensor) -> nn.Module:
    """A copy whose adaptive poolings are those of inputs of this length."""
    fixed = copy.deepcopy(model).eval()
    adaptive = (nn.AdaptiveAvgPool1d, nn.AdaptiveMaxPool1d)
    pools = {
        name: module
        for name, module in fixed.named_modules()
        if isinstance(module, adaptive)
    }
    lengths: dict[nn.Module, int] = {}

    def measure(module: nn.Module, given: tuple[torch.Tensor, ...]) -> None:
        lengths[module] = int(given[0].shape[-1])

    hooks = [module.register_forward_pre_hook(measure) for module in pools.values()]
    try:
        with torch.inference_mode():
            fixed(*inputs)
    except RuntimeError:
        raise GensigError(
            "this network does not take windows of acceleration; it cannot be written as ONNX",
        ) from None
    for hook in hooks:
        hook.remove()
    for name, module in pools.items():
        n_parts = int(np.ravel(module.output_size)[0])
        maximum = isinstance(module, nn.AdaptiveMaxPool1d)
        parts = EqualParts(lengths[module], n_parts, maximum=maximum)
        parent, _, last = name.rpartition(".")
        setattr(fixed.get_submodule(parent), last, parts)
    return fixed
