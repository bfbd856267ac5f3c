"""Training of one network: reproducible by its seed, stopped by validation units or never."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic

import numpy as np
import torch
from numpy.typing import NDArray

from diagnose.data.windows import IntArray, WindowSet, input_scale
from diagnose.settings import TrainSettings
from diagnose.training.target import LearningTarget, Model
from gensig.errors import ConfigError, SimulationError

OnEpoch = Callable[[int, float, float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Training(Generic[Model]):
    """A trained network and the course of its training.

    The best epoch is the one whose weights are kept: that with the least validation loss, or
    without early stopping the last one.

    Attributes
    ----------
    model : in evaluation mode, weights of the best epoch, on the processor
    last_model : the same with the weights of the last epoch; None if that is the best one
    best_epoch : counted from 1
    validation_loss : one value an epoch
    temperature : of the best epoch's answers for records, see `LearningTarget.temperature`
    """

    model: Model
    last_model: Model | None
    best_epoch: int
    validation_loss: tuple[float, ...]
    temperature: float

    def weights(self) -> dict[str, NDArray[Any]]:
        """Name -> array of the best epoch's weights."""
        return {name: value.numpy() for name, value in self.model.state_dict().items()}

    @property
    def detail(self) -> str:
        """Epochs of the training, in words."""
        return f"best epoch {self.best_epoch} of {len(self.validation_loss)}"


def train_network(
    train: WindowSet,
    validation: WindowSet,
    *,
    target: LearningTarget[Model],
    settings: TrainSettings,
    seed: int,
    on_epoch: OnEpoch = lambda epoch, training, validation: None,
) -> Training[Model]:
    """Train with early stopping on the validation units' loss, or without for patience 0.

    Without early stopping all epochs run and the weights of the last one are kept.

    Parameters
    ----------
    train, validation : windows of different units; training windows start anywhere in their
        stretch, at other samples each epoch
    target : gives the head, the loss and the answers for records
    settings : model, schedule, batch size, learning rate, weight decay, device
    seed : decides initial weights, order, window starts and dropout; same seed, threads and
        machine, same weights
    on_epoch : called with number, mean training loss and validation loss of each epoch

    Raises
    ------
    ConfigError    for a device that does not exist
    SimulationError    if no epoch has weights to keep, because the training diverges
    """
    device = device_of(settings.device)
    rng = np.random.default_rng([seed, target.stream])
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = target.network(settings.model, train, input_scale(train))
        model.to(
            device
        )  # weights are drawn on the processor: the same for every device
        schedule = settings.schedule
        n_drawn = windows_an_epoch(train, schedule.epoch_fraction)
        n_batches = max(n_drawn // settings.batch_size, 1)
        n_epochs = schedule.epochs_of(n_drawn)
        descent = _Descent(model, settings, n_epochs * n_batches)
        held_out = torch.from_numpy(validation.cut(np.arange(len(validation))))
        losses: list[float] = []
        best_weights, best_epoch = copy.deepcopy(model.state_dict()), 0
        for epoch in range(1, n_epochs + 1):
            batches = np.array_split(rng.permutation(len(train))[:n_drawn], n_batches)
            training_loss = _epoch(target, model, train, batches, rng, descent)
            answers = target.answers(model, held_out, validation)
            losses.append(target.record_loss(answers, validation))
            on_epoch(epoch, training_loss, losses[-1])
            is_kept = schedule.patience == 0 or losses[-1] <= min(losses)
            if np.isfinite(losses[-1]) and is_kept:
                best_weights, best_epoch = copy.deepcopy(model.state_dict()), epoch
                best_answers = answers
            if 0 < schedule.patience <= epoch - best_epoch:
                break
    if best_epoch == 0:
        raise SimulationError(
            "the training diverged from its first epoch; reduce learning_rate"
        )
    if schedule.patience == 0 and best_epoch < len(losses):
        raise SimulationError(
            "the training diverged before its last epoch; reduce learning_rate"
        )
    last_model = None
    if best_epoch < len(losses):
        last_model = copy.deepcopy(model).cpu().eval()
    model.load_state_dict(best_weights)
    return Training(
        model=model.cpu().eval(),
        last_model=last_model,
        best_epoch=best_epoch,
        validation_loss=tuple(losses),
        temperature=target.temperature(best_answers, validation),
    )


class _Descent:
    """AdamW with a learning rate that rises and falls once over all epochs."""

    def __init__(
        self, model: torch.nn.Module, settings: TrainSettings, n_steps: int
    ) -> None:
        rate, decay = settings.learning_rate, settings.weight_decay
        self.optimizer = torch.optim.AdamW(
            model.parameters(), lr=rate, weight_decay=decay
        )
        self.schedule = torch.optim.lr_scheduler.OneCycleLR(
            self.optimizer,
            max_lr=rate,
            total_steps=n_steps,
            pct_start=0.15,
        )

    def step(self, loss: torch.Tensor) -> None:
        """Move the weights down the gradient of one batch."""
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        self.schedule.step()


def _epoch(
    target: LearningTarget[Model],
    model: Model,
    train: WindowSet,
    batches: Sequence[IntArray],
    rng: np.random.Generator,
    descent: _Descent,
) -> float:
    """Mean loss over the batches of an epoch, each followed by a step."""
    model.train()
    device = next(model.parameters()).device
    total = 0.0
    for batch in batches:
        signals = torch.from_numpy(train.cut(batch, rng)).to(device)
        loss = target.loss(model, signals, train, batch)
        descent.step(loss)
        total += float(loss.detach())
    model.eval()
    return total / len(batches)


def device_of(name: str) -> torch.device:
    """Device of a setting: ``auto`` is a GPU if there is one.

    Raises
    ------
    ConfigError    for ``cuda`` without a GPU
    """
    present = torch.cuda.is_available()
    if name == "cuda" and not present:
        raise ConfigError(
            "device=cuda: torch finds no GPU here; use device=auto or device=cpu"
        )
    if present and name != "cpu":
        return torch.device("cuda")
    return torch.device("cpu")


def windows_an_epoch(windows: WindowSet, fraction: float) -> int:
    """Windows that hold the given share of the signal, at most as many as are planned."""
    lengths = [signal.shape[-1] for signal in windows.signals]
    length = sum(max(length, windows.window_samples) for length in lengths)
    return max(min(round(fraction * length / windows.window_samples), len(windows)), 1)
