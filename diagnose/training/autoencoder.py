"""A small convolutional autoencoder of windows, whose reconstruction error shows novelty."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import nn

from diagnose.data.windows import FloatArray, WindowSet, input_scale
from diagnose.settings import TrainSettings
from diagnose.training.train import device_of
from gensig.errors import ConfigError, SimulationError

# Assumed: the first kernel is four strides long, as in configs/model/cnn.yaml, the others two.
STRIDES = (16, 4, 2)
WIDTHS = (16, 32, 8)  # assumed: the code is 8 numbers every 128 samples
STEP = math.prod(STRIDES)  # samples of one step of the code
STRETCH = 64  # samples, 1.25 ms at 51.2 kHz: about one mesh period at 800 Hz
MOST_WINDOWS = 1000  # drawn an epoch


class WindowAutoencoder(nn.Module):
    """Three strided convolutions, and three transposed ones as their mirror image.

    Batch normalisation and ReLU follow each of them, except for the code and the output.

    Parameters
    ----------
    scale : (channel,) divisor of the input

    Source: Masci, Meier, Ciresan & Schmidhuber (2011), "Stacked convolutional auto-encoders for
    hierarchical feature extraction", ICANN, with strides in place of pooling, trained as one.
    """

    scale: torch.Tensor

    def __init__(self, scale: Sequence[float]) -> None:
        super().__init__()
        self.register_buffer(
            "scale", torch.tensor(list(scale), dtype=torch.float32)[:, None]
        )
        first, second, third = STRIDES
        wide, narrow, code = WIDTHS
        n_channels = len(scale)
        self.encoder = nn.Sequential(
            nn.Conv1d(n_channels, wide, 4 * first, first, 3 * first // 2),
            nn.BatchNorm1d(wide),
            nn.ReLU(),
            nn.Conv1d(wide, narrow, 2 * second, second, second // 2),
            nn.BatchNorm1d(narrow),
            nn.ReLU(),
            nn.Conv1d(narrow, code, 2 * third, third, third // 2),
        )
        self.decoder = nn.Sequential(
            nn.ConvTranspose1d(code, narrow, 2 * third, third, third // 2),
            nn.BatchNorm1d(narrow),
            nn.ReLU(),
            nn.ConvTranspose1d(narrow, wide, 2 * second, second, second // 2),
            nn.BatchNorm1d(wide),
            nn.ReLU(),
            nn.ConvTranspose1d(wide, n_channels, 4 * first, first, 3 * first // 2),
        )

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Squared error (window, sample) of the rebuilt windows, mean over the channels.

        The windows are (window, channel, sample). Samples past the last whole step of the code
        are left out.
        """
        scaled = windows[..., : windows.shape[-1] // STEP * STEP] / self.scale
        return (self.decoder(self.encoder(scaled)) - scaled).square().mean(dim=1)


def check_window_for_autoencoder(window_samples: int) -> None:
    """Refuse a window in which the code has no whole step.

    Raises
    ------
    ConfigError    with the least number of samples
    """
    if window_samples < STEP:
        raise ConfigError(
            f"window_samples={window_samples} is too short for the autoencoder; "
            f"give at least {STEP}"
        )


def fit_autoencoder(
    train: WindowSet, validation: WindowSet, *, settings: TrainSettings, seed: int
) -> tuple[WindowAutoencoder, int]:
    """Train on windows of known kind, up to the least error on other units of that kind.

    With patience 0 all epochs run and the weights of the last one are kept.

    Parameters
    ----------
    train, validation : of different units; training windows start anywhere in their stretch, at
        other samples each epoch
    settings : epochs, patience, batch size, learning rate, device
    seed : decides initial weights, order and window starts; the same seed gives the same bits on
        the same processor

    Returns
    -------
    autoencoder in evaluation mode, and its epoch, from 1

    Raises
    ------
    SimulationError    if no epoch has weights to keep, because the training diverges
    """
    device = device_of(settings.device)
    rng = np.random.default_rng([seed, 3])
    held_out = torch.from_numpy(validation.cut(np.arange(len(validation))))
    n_drawn = min(len(train), MOST_WINDOWS)
    n_batches = max(n_drawn // settings.batch_size, 1)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = WindowAutoencoder(input_scale(train)).to(device)
        optimizer = torch.optim.Adam(model.parameters(), lr=settings.learning_rate)
        schedule = settings.usual_schedule
        best, best_epoch, best_weights = np.inf, 0, model.state_dict()
        for epoch in range(1, schedule.epochs + 1):
            model.train()
            drawn = rng.permutation(len(train))[:n_drawn]
            for batch in np.array_split(drawn, n_batches):
                optimizer.zero_grad()
                windows = torch.from_numpy(train.cut(batch, rng)).to(device)
                model(windows).mean().backward()
                optimizer.step()
            loss = float(_errors(model, held_out).mean())
            if loss < best or (schedule.patience == 0 and np.isfinite(loss)):
                best, best_epoch = loss, epoch
                best_weights = copy.deepcopy(model.state_dict())
            if 0 < schedule.patience <= epoch - best_epoch:
                break
    if best_epoch == 0:
        raise SimulationError(
            "the autoencoder diverged from its first epoch; reduce learning_rate"
        )
    if schedule.patience == 0 and best_epoch < schedule.epochs:
        raise SimulationError(
            "the autoencoder diverged before its last epoch; reduce learning_rate"
        )
    model.load_state_dict(best_weights)
    return model.cpu().eval(), best_epoch


def reconstruction_error(
    model: WindowAutoencoder, windows: WindowSet, *, batch_size: int = 64
) -> FloatArray:
    """(window,) largest mean squared error over `STRETCH` samples, at the planned starts.

    A fault of one tooth shows for a moment once a turn. In the mean over the window it is hidden
    by the noise, which no autoencoder rebuilds. The largest value instead of the mean is ours.

    Source of the error as novelty: Japkowicz, Myers & Gluck (1995), "A novelty detection approach
    to classification", IJCAI.
    """
    largest = []
    for block in windows.blocks(batch_size):
        error = _errors(model, torch.from_numpy(windows.cut(block)))
        means = error.unfold(1, STRETCH, STRETCH // 2).mean(dim=2)
        largest.append(means.amax(dim=1))
    return torch.cat(largest).numpy().astype(float)


def _errors(
    model: WindowAutoencoder, windows: torch.Tensor, *, batch_size: int = 16
) -> torch.Tensor:
    """(window, sample) on the processor, in batches that stay in its cache."""
    model.eval()
    device = model.scale.device
    blocks = windows.split(batch_size)
    with torch.inference_mode():
        return torch.cat([model(block.to(device)).cpu() for block in blocks])
