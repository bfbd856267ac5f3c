"""A small autoencoder of spectra over time: what it cannot rebuild is unlike what it was trained on."""

from __future__ import annotations

import copy
import itertools
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.windows import WindowSet
from gensig.errors import ConfigError, SimulationError

FloatArray = NDArray[np.floating]

# As published, see `BandAutoencoder`; a step is half a frame.
FRAME_SAMPLES = 1024
N_BANDS = 128
N_FRAMES = 5
N_HIDDEN, N_CODE = 128, 8
N_EPOCHS, BATCH_SIZE, LEARNING_RATE = 100, 512, 1e-3
PATIENCE = 10  # epochs without a smaller error on validation units before stopping; ours, like all choice of the epoch
SHORTEST_FRAME = 16
FLOOR = 1e-10  # of the mean power, 100 dB below it: what is silent has a level still
MOST_WINDOWS = 2000  # evenly spaced over the training, so that memory is bounded


class BandAutoencoder(nn.Module):
    """Dense autoencoder of five consecutive spectral frames with a code of eight numbers.

    Four layers of 128, the code, four layers of 128, each with batch normalisation and ReLU, then a linear layer. Ours:
    bands of equal width in place of mel bands, which suit the ear; channels side by side; inputs standardised.

    Parameters
    ----------
    mean, scale : (input,) of the training inputs

    Source: Koizumi, Kawaguchi, Imoto et al. (2020), "Description and discussion on DCASE2020 challenge task 2:
    unsupervised anomalous sound detection for machine condition monitoring", DCASE Workshop, the baseline system.
    Reconstruction error as novelty: Japkowicz, Myers & Gluck (1995), "A novelty detection approach to
    classification", IJCAI.
    """

    mean: torch.Tensor
    scale: torch.Tensor

    def __init__(self, mean: torch.Tensor, scale: torch.Tensor) -> None:
        super().__init__()
        self.register_buffer("mean", mean)
        self.register_buffer("scale", scale)
        n_inputs = mean.numel()
        sizes = [n_inputs, *[N_HIDDEN] * 4, N_CODE, *[N_HIDDEN] * 4]
        layers: list[nn.Module] = []
        for n_in, n_out in itertools.pairwise(sizes):
            layers += [nn.Linear(n_in, n_out), nn.BatchNorm1d(n_out), nn.ReLU()]
        self.layers = nn.Sequential(*layers, nn.Linear(N_HIDDEN, n_inputs))

    def forward(self, inputs: torch.Tensor) -> torch.Tensor:
        """Mean squared error (row,) of the rebuilt rows (row, input), in standard deviations of the training."""
        standard = (inputs - self.mean) / self.scale
        return (self.layers(standard) - standard).square().mean(dim=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Autoencoder:
    """A trained autoencoder in evaluation mode; `best_epoch` of validation units counts from 1."""

    model: BandAutoencoder
    best_epoch: int


def frame_samples(window_samples: int) -> int:
    """Samples a frame: as published, or the largest power of two of which a window holds five at half a frame's step.

    Raises
    ------
    ConfigError    for a window that is too short
    """
    longest = 2 * window_samples // (N_FRAMES + 1)
    if longest < SHORTEST_FRAME:
        least = SHORTEST_FRAME * (N_FRAMES + 1) // 2
        raise ConfigError(f"window_samples={window_samples} is too short for an autoencoder; give at least {least}")
    return min(FRAME_SAMPLES, 2 ** int(np.log2(longest)))


def fit_autoencoder(train: WindowSet, validation: WindowSet, *, device: torch.device, seed: int) -> Autoencoder:
    """Train on windows of known kind; the weights kept are those of the least error on other units of that kind.

    Parameters
    ----------
    train, validation : of different units
    device : of the training; the same seed gives the same bits on the same processor
    seed : decides initial weights and order

    Raises
    ------
    SimulationError    if the training diverges from its first epoch
    """
    chosen = np.unique(np.linspace(0, len(train) - 1, min(len(train), MOST_WINDOWS)).round().astype(int))
    inputs = torch.cat([rows.flatten(0, 1) for rows in _inputs(train, chosen)])
    held_out = torch.cat([rows.flatten(0, 1) for rows in _inputs(validation, np.arange(len(validation)))])
    deviation = inputs.std(dim=0)
    scale = torch.where(deviation > 0, deviation, torch.ones_like(deviation))
    rng = np.random.default_rng([seed, 3])
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = BandAutoencoder(inputs.mean(dim=0), scale).to(device)
        optimizer = torch.optim.Adam(model.parameters(), lr=LEARNING_RATE)
        best, best_weights, best_epoch = np.inf, model.state_dict(), 0
        for epoch in range(1, N_EPOCHS + 1):
            model.train()
            for batch in np.array_split(rng.permutation(len(inputs)), max(len(inputs) // BATCH_SIZE, 1)):
                optimizer.zero_grad()
                model(inputs[torch.from_numpy(batch)].to(device)).mean().backward()
                optimizer.step()
            model.eval()
            with torch.inference_mode():
                loss = float(torch.cat([model(rows.to(device)) for rows in held_out.split(BATCH_SIZE)]).mean())
            if loss < best:
                best, best_weights, best_epoch = loss, copy.deepcopy(model.state_dict()), epoch
            if epoch - best_epoch >= PATIENCE:
                break
    if best_epoch == 0:
        raise SimulationError("the autoencoder diverged from its first epoch")
    model.load_state_dict(best_weights)
    return Autoencoder(model=model.cpu().eval(), best_epoch=best_epoch)


def reconstruction_error(autoencoder: Autoencoder, windows: WindowSet) -> FloatArray:
    """(window,) mean squared error over the frames of each window at its planned start."""
    with torch.inference_mode():
        blocks = [
            autoencoder.model(rows.flatten(0, 1)).reshape(rows.shape[:2]).mean(dim=1)
            for rows in _inputs(windows, np.arange(len(windows)))
        ]
    return torch.cat(blocks).numpy().astype(float)


def _inputs(windows: WindowSet, chosen: NDArray[np.integer], *, block: int = 64) -> list[torch.Tensor]:
    """Blocks (window, row, input) of `frame_rows` of chosen windows."""
    parts = np.array_split(chosen, -(-chosen.size // block))
    return [frame_rows(torch.from_numpy(windows.cut(part))) for part in parts]


def frame_rows(windows: torch.Tensor) -> torch.Tensor:
    """Five consecutive frames of band levels side by side, in decibels.

    Parameters
    ----------
    windows : (window, channel, sample)

    Returns
    -------
    (window, row, channel x band x frame), a row starting at every frame that four others follow
    """
    n_windows, n_channels, n_samples = windows.shape
    frame = frame_samples(n_samples)
    n_bands = min(N_BANDS, frame // 2)
    taper = torch.hann_window(frame, dtype=windows.dtype)
    frames = windows.unfold(2, frame, frame // 2) * taper
    power = torch.fft.rfft(frames).abs().square()[..., 1:]  # without the mean
    bands = power.reshape(n_windows, n_channels, -1, n_bands, power.shape[-1] // n_bands).mean(dim=-1)
    tiny = torch.finfo(windows.dtype).tiny
    least = FLOOR * bands.mean(dim=(2, 3), keepdim=True) + tiny
    rows = (10 * torch.log10(bands + least)).unfold(2, N_FRAMES, 1)
    return rows.transpose(1, 2).flatten(2)
