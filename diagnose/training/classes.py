"""Classes as learning target: cross-entropy, further heads, log-probabilities of records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.nn.functional import log_softmax

from diagnose.data.windows import FloatArray, IntArray, WindowSet
from diagnose.networks.calibration import fit_temperature
from diagnose.networks.network import Network
from diagnose.networks.registry import build_model
from diagnose.scoring.metrics import over_records
from diagnose.training.target import LearningTarget, batch_targets
from gensig.options.configuration import Section

ENTRY = ("entry",)  # targets that are the same for every class
CACHED = 16  # windows that stay in the cache of a processor


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Classes(LearningTarget[Network]):
    """Class of a record, and with further heads its severity and faulty gear.

    Attributes
    ----------
    n_classes : of the task
    """

    n_classes: int
    stream: ClassVar[int] = 1

    def network(
        self,
        model_config: Section,
        train: WindowSet,
        input_scale: Sequence[float],
    ) -> Network:
        """Network with one score a class."""
        return build_model(
            model_config,
            n_channels=len(input_scale),
            n_classes=self.n_classes,
            input_scale=input_scale,
        )

    def loss(
        self,
        model: Network,
        signals: torch.Tensor,
        windows: WindowSet,
        batch: IntArray,
    ) -> torch.Tensor:
        """Loss of the network, see `diagnose.networks.network.Network.loss`."""
        device = signals.device
        label = torch.from_numpy(windows.label[batch]).to(device)
        weights = _class_weights(windows.label, self.n_classes)
        with _mixed_precision(device):
            return model.loss(
                signals,
                label,
                batch_targets(windows, batch, device),
                torch.from_numpy(weights).to(device),
            )

    def answers(
        self, model: Network, signals: torch.Tensor, windows: WindowSet
    ) -> FloatArray:
        """(window, class) log-probabilities."""
        return _log_probabilities(model, signals)

    def record_loss(self, answers: FloatArray, windows: WindowSet) -> float:
        """Cross-entropy of record predictions, each class present counting the same."""
        by_record, label = _over_labelled_records(answers, windows)
        losses = -by_record[np.arange(label.size), label]
        by_class = [losses[label == present].mean() for present in np.unique(label)]
        return float(np.mean(by_class))

    def temperature(self, answers: FloatArray, windows: WindowSet) -> float:
        """Temperature with the least cross-entropy over the records."""
        return fit_temperature(*_over_labelled_records(answers, windows))


def predict_windows(
    model: nn.Module, windows: WindowSet, *, batch_size: int = 64
) -> FloatArray:
    """(window, class) log-probabilities at the planned starts.

    The batch size changes speed only.
    """
    rows = []
    for block in windows.blocks(batch_size):
        signals = torch.from_numpy(windows.cut(block))
        rows.append(_log_probabilities(model, signals))
    return np.concatenate(rows)


def _log_probabilities(model: nn.Module, signals: torch.Tensor) -> FloatArray:
    """(window, class) log-probabilities, in batches of `CACHED` windows."""
    model.eval()
    device = next(model.parameters()).device
    with torch.inference_mode():
        blocks = [
            log_softmax(model(block.to(device)), dim=1)
            for block in signals.split(CACHED)
        ]
    return torch.cat(blocks).cpu().numpy().astype(float)


def _over_labelled_records(
    log_probability: FloatArray,
    windows: WindowSet,
) -> tuple[FloatArray, IntArray]:
    """Predictions (record, class) and labels (record,)."""
    _, by_record = over_records(log_probability, windows.record)
    _, first = np.unique(windows.record, return_index=True)
    return by_record, windows.label[first]


def with_shuffled_labels(
    windows: WindowSet,
    n_classes: int,
    rng: np.random.Generator,
) -> WindowSet:
    """Windows with labels of `shuffled_labels`.

    Of the other targets only the entry of a tooth is kept, which tells nothing of a fault.
    """
    label = shuffled_labels(windows.label, windows.record, n_classes, rng)
    kept = {name: windows.targets[name] for name in ENTRY if name in windows.targets}
    return replace(windows, label=label, targets=kept)


def shuffled_labels(
    label: IntArray, record: IntArray, n_classes: int, rng: np.random.Generator
) -> IntArray:
    """Labels (row,) that do not depend on the class, one label a record.

    Within each true class all labels have the same shares, in random order. A plain permutation
    leaves every class a majority label by chance, and a network that finds the classes then
    scores 0, 1/4, 1/2, ... at random.
    """
    _, first, position = np.unique(record, return_index=True, return_inverse=True)
    true = label[first]
    share = np.bincount(true, minlength=n_classes) / true.size
    shuffled = np.empty_like(true)
    for present in np.unique(true):
        members = np.flatnonzero(true == present)
        counts = np.floor(share * members.size + 1e-9).astype(int)
        labels = np.repeat(np.arange(n_classes), counts)
        n_missing = members.size - labels.size
        extra = rng.permutation(np.flatnonzero(share > 0))[:n_missing]
        shuffled[members] = rng.permutation(np.concatenate([labels, extra]))
    return shuffled[position]


def _mixed_precision(device: torch.device) -> torch.autocast:
    """Products in bfloat16 on a GPU that supports it (capability 8), else in 32 bits."""
    capable = device.type == "cuda" and torch.cuda.get_device_capability(device)[0] >= 8
    return torch.autocast(device.type, dtype=torch.bfloat16, enabled=capable)


def _class_weights(label: IntArray, n_classes: int) -> NDArray[np.float32]:
    """Inverse frequency of each class, so that all count the same; 0 for an absent one."""
    counts = np.bincount(label, minlength=n_classes).astype(np.float32)
    present = counts > 0
    total = counts.sum() / present.sum()
    weights = np.divide(total, counts, out=np.zeros_like(counts), where=present)
    return weights.astype(np.float32)
