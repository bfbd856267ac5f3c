"""Training of one network: reproducible by its seed, stopped by validation units only."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.nn.functional import cross_entropy, log_softmax

from diagnose.data.targets import further_loss, place_loss
from diagnose.data.windows import WindowSet, input_scale
from diagnose.networks.calibration import fit_temperature
from diagnose.networks.network import Network
from diagnose.networks.registry import build_model
from diagnose.scoring.metrics import over_records
from diagnose.settings import TrainSettings
from gensig.errors import ConfigError, SimulationError

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]

HEADS_WEIGHT = 0.3  # of each further head against the classes; assumed


@dataclass(frozen=True, slots=True, kw_only=True)
class Training:
    """A trained network and how it came about.

    Attributes
    ----------
    model : in evaluation mode, weights of the best epoch, on the processor
    last_model : the same with the weights of the last epoch; None where the last epoch is the best one
    best_epoch : counted from 1
    validation_loss : one value an epoch
    temperature : of the best epoch's record predictions, see `diagnose.networks.calibration.fit_temperature`
    """

    model: Network
    last_model: Network | None
    best_epoch: int
    validation_loss: tuple[float, ...]
    temperature: float


def train_network(
    train: WindowSet,
    validation: WindowSet,
    *,
    model_config: Mapping[str, Any],
    n_classes: int,
    settings: TrainSettings,
    seed: int,
    on_epoch: Callable[[int, float, float], None] = lambda epoch, training, validation: None,
) -> Training:
    """Train with early stopping on the validation units' loss.

    Parameters
    ----------
    train, validation : windows of different units; training windows start anywhere in their stretch, anew each epoch
    model_config : see `diagnose.networks.registry.build_model`
    n_classes : of the task
    settings : epochs, patience, batch size, learning rate, weight decay, share drawn an epoch, device
    seed : decides initial weights, order, window starts and dropout; same seed, threads and machine, same weights
    on_epoch : told number, mean training loss and validation loss of each epoch

    Raises
    ------
    ConfigError    for a device that is not there
    SimulationError    if the first epoch diverges
    """
    device = device_of(settings.device)
    rng = np.random.default_rng([seed, 1])
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        scale = input_scale(train)
        model = build_model(model_config, n_channels=len(scale), n_classes=n_classes, input_scale=scale)
        model.to(device)  # the weights were drawn on the processor: the same ones on every device
        optimizer = torch.optim.AdamW(model.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay)
        n_drawn = windows_an_epoch(train, settings.epoch_fraction)
        n_batches = max(n_drawn // settings.batch_size, 1)
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimizer, max_lr=settings.learning_rate, total_steps=settings.epochs * n_batches, pct_start=0.15
        )
        weight = torch.from_numpy(_class_weights(train.label, n_classes)).to(device)
        held_out = torch.from_numpy(validation.cut(np.arange(len(validation))))
        losses: list[float] = []
        best_weights, best_epoch = copy.deepcopy(model.state_dict()), 0
        for epoch in range(1, settings.epochs + 1):
            model.train()
            total = 0.0
            for batch in np.array_split(rng.permutation(len(train))[:n_drawn], n_batches):
                windows = torch.from_numpy(train.cut(batch, rng)).to(device)
                label = torch.from_numpy(train.label[batch]).to(device)
                targets = {name: torch.from_numpy(of[batch]).to(device) for name, of in train.targets.items()}
                optimizer.zero_grad()
                with _mixed_precision(device):
                    loss = _loss(model, windows, label, weight, targets)
                loss.backward()
                optimizer.step()
                schedule.step()
                total += float(loss.detach())
            log_probability = _log_probabilities(model, held_out)
            losses.append(record_loss(log_probability, validation))
            on_epoch(epoch, total / n_batches, losses[-1])
            if np.isfinite(losses[-1]) and losses[-1] <= min(losses):
                best_weights, best_epoch = copy.deepcopy(model.state_dict()), epoch
                best_log_probability = log_probability
            if epoch - best_epoch >= settings.patience:
                break
    if best_epoch == 0:
        raise SimulationError("the training diverged from its first epoch; reduce learning_rate")
    last_model = copy.deepcopy(model).cpu().eval() if best_epoch < len(losses) else None
    model.load_state_dict(best_weights)
    return Training(
        model=model.cpu().eval(),
        last_model=last_model,
        best_epoch=best_epoch,
        validation_loss=tuple(losses),
        temperature=fit_temperature(*_over_labelled_records(best_log_probability, validation)),
    )


def _loss(
    model: Network,
    windows: torch.Tensor,
    label: torch.Tensor,
    weight: torch.Tensor,
    targets: Mapping[str, torch.Tensor],
) -> torch.Tensor:
    """Cross-entropy of the classes, and beside it what the targets say of the heads and of the place of the fault."""
    answers = model.answers(windows)
    loss = cross_entropy(answers["classes"], label, weight=weight)
    if model.further:
        loss = loss + HEADS_WEIGHT * further_loss(answers, label, targets)
    if "places" in answers and {"gear", "place"} <= set(targets):
        loss = loss + place_loss(answers["places"], label, targets["gear"], targets["place"], model.turns)
    return loss


def device_of(name: str) -> torch.device:
    """Device of a setting: ``auto`` is a GPU if one is present, else the processor; the name of one must be there.

    Raises
    ------
    ConfigError    for ``cuda`` where there is none
    """
    present = torch.cuda.is_available()
    if name == "cuda" and not present:
        raise ConfigError("device=cuda: torch finds no GPU here; use device=auto or device=cpu")
    return torch.device("cuda" if present and name != "cpu" else "cpu")


def _mixed_precision(device: torch.device) -> torch.autocast:
    """Products in bfloat16 on a GPU that computes in it (compute capability 8), everything in 32 bits elsewhere."""
    capable = device.type == "cuda" and torch.cuda.get_device_capability(device)[0] >= 8
    return torch.autocast(device.type, dtype=torch.bfloat16, enabled=capable)


def predict_windows(model: nn.Module, windows: WindowSet, *, batch_size: int = 64) -> FloatArray:
    """Log-probabilities (window, class) at the planned starts; the batch size changes speed only."""
    every = np.arange(len(windows))
    blocks = np.array_split(every, -(-every.size // batch_size))
    return np.concatenate([_log_probabilities(model, torch.from_numpy(windows.cut(block))) for block in blocks])


def _log_probabilities(model: nn.Module, windows: torch.Tensor, *, batch_size: int = 16) -> FloatArray:
    """(window, class), in batches that stay in the cache of a processor."""
    model.eval()
    device = next(model.parameters()).device
    with torch.inference_mode():
        blocks = [log_softmax(model(block.to(device)), dim=1) for block in windows.split(batch_size)]
    return torch.cat(blocks).cpu().numpy().astype(float)


def record_loss(log_probability: FloatArray, windows: WindowSet) -> float:
    """Cross-entropy of record predictions, each class present counting the same."""
    by_record, label = _over_labelled_records(log_probability, windows)
    losses = -by_record[np.arange(label.size), label]
    return float(np.mean([losses[label == present].mean() for present in np.unique(label)]))


def _over_labelled_records(log_probability: FloatArray, windows: WindowSet) -> tuple[FloatArray, IntArray]:
    """Predictions (record, class) and labels (record,)."""
    _, by_record = over_records(log_probability, windows.record)
    _, first = np.unique(windows.record, return_index=True)
    return by_record, windows.label[first]


def with_shuffled_labels(windows: WindowSet, n_classes: int, rng: np.random.Generator) -> WindowSet:
    """Give every record a label that tells nothing of its class, all windows of a record the same; no other targets.

    Within each true class all labels are dealt in the same proportions, in random order. A plain permutation leaves
    every class a majority label by chance, and a network that finds the classes then scores 0, 1/4, 1/2, ... at random.
    """
    records, first, position = np.unique(windows.record, return_index=True, return_inverse=True)
    true = windows.label[first]
    share = np.bincount(true, minlength=n_classes) / true.size
    shuffled = np.empty_like(true)
    for label in np.unique(true):
        members = np.flatnonzero(true == label)
        wanted = share * members.size
        dealt = np.repeat(np.arange(n_classes), np.floor(wanted + 1e-9).astype(int))
        n_missing = members.size - dealt.size
        left = np.flatnonzero(share > 0)
        extra = rng.permutation(left)[:n_missing] if n_missing <= left.size else rng.choice(left, n_missing)
        shuffled[members] = rng.permutation(np.concatenate([dealt, extra]))
    assert records.size == shuffled.size
    return replace(windows, label=shuffled[position], targets={})


def windows_an_epoch(windows: WindowSet, fraction: float) -> int:
    """Windows that hold the given share of the signal, at most as many as are planned."""
    length = sum(signal.shape[-1] for signal in windows.signals)
    return max(min(round(fraction * length / windows.window_samples), len(windows)), 1)


def _class_weights(label: IntArray, n_classes: int) -> NDArray[np.float32]:
    """Inverse frequency of each class, so that rare classes count the same; 0 for an absent one."""
    counts = np.bincount(label, minlength=n_classes).astype(np.float32)
    present = counts > 0
    weights = np.divide(counts.sum() / present.sum(), counts, out=np.zeros_like(counts), where=present)
    return weights.astype(np.float32)
