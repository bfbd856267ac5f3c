"""A network that says the remaining life: any network of `diagnose.networks.registry` with a regression head."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.data.windows import WindowSet
from diagnose.networks.registry import build_model
from diagnose.scoring.metrics import over_records
from diagnose.settings import TrainSettings
from diagnose.training.train import device_of, input_scale, windows_an_epoch
from gensig.errors import SimulationError

FloatArray = NDArray[np.floating]
HEARD = 16  # numbers that the head takes of the network; assumed


class LifeNetwork(nn.Module):
    """Windows (window, channel, sample) and what is known beside (window, column) in, a share of the early level out.

    Parameters
    ----------
    model_config : of `diagnose.networks.registry.build_model`, which hears the windows
    scale : (channel,) typical RMS of each channel
    mean, spread : (column,) of what is known beside, in the training
    """

    ear: nn.Module
    mean: torch.Tensor
    spread: torch.Tensor

    def __init__(self, model_config: Mapping[str, Any], scale: list[float], mean: FloatArray, spread: FloatArray):
        super().__init__()
        self.ear = build_model(model_config, n_channels=len(scale), n_classes=HEARD, input_scale=scale)
        self.register_buffer("mean", torch.tensor(mean, dtype=torch.float32))
        self.register_buffer("spread", torch.tensor(spread, dtype=torch.float32))
        self.head = nn.Sequential(nn.ReLU(), nn.Linear(HEARD + len(mean), HEARD), nn.ReLU(), nn.Linear(HEARD, 1))

    def forward(self, windows: torch.Tensor, beside: torch.Tensor) -> torch.Tensor:
        """(window,) remaining life as a share of the early level, not cut."""
        known = (beside - self.mean) / self.spread
        return self.head(torch.cat([self.ear(windows), known], dim=1)).squeeze(1)


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeTraining:
    """A trained network in evaluation mode, its best epoch counted from 1, and the validation RMSE of every epoch."""

    model: LifeNetwork
    best_epoch: int
    validation_loss: tuple[float, ...]


def train_life_network(
    train: WindowSet,
    validation: WindowSet,
    beside: FloatArray,
    target: FloatArray,
    weight: FloatArray,
    *,
    settings: TrainSettings,
    seed: int,
) -> LifeTraining:
    """Least squares with early stopping on the validation lives.

    Parameters
    ----------
    train, validation : windows of different lives, all of known target; those of the training start anywhere
    beside : (record, column) what is known beside the signal, of all records of the data set
    target : (record,) share of the early level, of all records
    weight : (record,) of all records; those of one life sum to the same for every life of a subset
    settings : model, epochs, patience, batch size, learning rate, weight decay, share drawn an epoch, device
    seed : decides weights, order and window starts; the same seed gives the same bits on the same processor

    Raises
    ------
    SimulationError    if the training diverges from its first epoch
    """
    device = device_of(settings.device)
    rng = np.random.default_rng([seed, 4])
    seen = np.unique(train.record)
    spread = beside[seen].std(axis=0)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = LifeNetwork(
            settings.model, input_scale(train), beside[seen].mean(axis=0), np.where(spread > 0, spread, 1.0)
        )
        model.to(device)
        optimizer = torch.optim.AdamW(model.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay)
        n_drawn = windows_an_epoch(train, settings.epoch_fraction)
        n_batches = max(n_drawn // settings.batch_size, 1)
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimizer, max_lr=settings.learning_rate, total_steps=settings.epochs * n_batches, pct_start=0.15
        )
        known, true, heavy = (values.astype(np.float32)[train.record] for values in (beside, target, weight))
        losses: list[float] = []
        best_weights, best_epoch = copy.deepcopy(model.state_dict()), 0
        for epoch in range(1, settings.epochs + 1):
            model.train()
            for batch in np.array_split(rng.permutation(len(train))[:n_drawn], n_batches):
                windows = torch.from_numpy(train.cut(batch, rng)).to(device)
                optimizer.zero_grad()
                said = model(windows, torch.from_numpy(known[batch]).to(device))
                error = said - torch.from_numpy(true[batch]).to(device)
                (torch.from_numpy(heavy[batch]).to(device) * error.square()).mean().backward()
                optimizer.step()
                schedule.step()
            record, share = said_of_records(model, validation, beside)
            losses.append(float(np.sqrt(np.average((share - target[record]) ** 2, weights=weight[record]))))
            if np.isfinite(losses[-1]) and losses[-1] <= min(losses):
                best_weights, best_epoch = copy.deepcopy(model.state_dict()), epoch
            if epoch - best_epoch >= settings.patience:
                break
    if best_epoch == 0:
        raise SimulationError("the training diverged from its first epoch; reduce learning_rate")
    model.load_state_dict(best_weights)
    return LifeTraining(model=model.cpu().eval(), best_epoch=best_epoch, validation_loss=tuple(losses))


def said_of_records(
    model: LifeNetwork, windows: WindowSet, beside: FloatArray, *, batch_size: int = 32
) -> tuple[NDArray[np.integer], FloatArray]:
    """Records (record,), sorted, and what the network says of them, the mean over their windows, cut to 0..1."""
    said = said_of_windows(model, windows, beside, batch_size=batch_size)
    record, share = over_records(said[:, None], windows.record)
    return record, np.clip(share[:, 0], 0.0, 1.0)


def said_of_windows(
    model: LifeNetwork, windows: WindowSet, beside: FloatArray, *, batch_size: int = 32
) -> NDArray[np.float64]:
    """(window,) what the network says, not cut; ``beside`` (record, column) of all records."""
    model.eval()
    device = model.mean.device
    known = beside.astype(np.float32)[windows.record]
    every = np.arange(len(windows))
    said = []
    with torch.inference_mode():
        for block in np.array_split(every, -(-every.size // batch_size)):
            signals = torch.from_numpy(windows.cut(block)).to(device)
            said.append(model(signals, torch.from_numpy(known[block]).to(device)).cpu())
    return torch.cat(said).numpy().astype(float)
