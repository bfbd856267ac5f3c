"""Random changes of windows: noise, gain, shift, resampling and dropped channels.

Each acts on a batch (batch, channel, sample) or on one window (channel, sample), on any device.
Every example of a batch gets draws of its own.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch

from gensig.errors import ConfigError

Windows = torch.Tensor
Range = tuple[float, float]

# Exponent of frequency by which the power density of a noise falls.
COLORS = {"white": 0.0, "pink": 1.0, "brown": 2.0}
# Points a sample between which `Resample` interpolates by cubic polynomials.
POINTS_PER_SAMPLE = 4


class Transform(ABC):
    """Random change of windows; a callable that keeps their type and device.

    Draws come from the generator that is given, else from the generator of torch on the device
    of the windows. ``torch.manual_seed`` makes the latter repeatable, and a loader seeds it
    differently in each of its workers.
    """

    __slots__ = ()

    def __call__(
        self, windows: Windows, generator: torch.Generator | None = None
    ) -> Windows:
        """Changed windows.

        Parameters
        ----------
        windows : (batch, channel, sample) or (channel, sample)
        generator : source of the draws, on any device

        Raises
        ------
        ConfigError    for a tensor with other axes
        """
        if windows.ndim == 2:
            return self.changed(windows[None], generator)[0]
        if windows.ndim != 3:
            raise ConfigError(
                f"windows of shape {tuple(windows.shape)}: give (batch, channel, sample) or "
                "(channel, sample)"
            )
        return self.changed(windows, generator)

    @abstractmethod
    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Changed windows of a batch (batch, channel, sample)."""


AnyTransform = Transform | Callable[[Windows], Windows]


def transformed(
    windows: Windows,
    transform: AnyTransform | None,
    generator: torch.Generator | None = None,
) -> Windows:
    """Windows after a transform; only a `Transform` draws from ``generator``."""
    if transform is None:
        return windows
    if isinstance(transform, Transform):
        return transform(windows, generator)
    return transform(windows)


@dataclass(frozen=True, slots=True)
class Compose(Transform):
    """Several transforms one after the other.

    Parameters
    ----------
    transforms : in their order; callables of others too, which act on batches or windows
    """

    transforms: Sequence[AnyTransform]

    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Windows after all transforms."""
        for transform in self.transforms:
            windows = transformed(windows, transform, generator)
        return windows


@dataclass(frozen=True, slots=True)
class AddNoise(Transform):
    """Noise at a signal-to-noise ratio drawn for each window.

    Parameters
    ----------
    snr_db : lowest and highest ratio of the mean square of a channel to that of its noise, dB
    color : ``"white"``, ``"pink"`` (power density 1/f) or ``"brown"`` (1/f^2)

    Notes
    -----
    The ratio is one draw a window, the same for all channels. Their noises are independent.
    """

    snr_db: Range
    color: str = "white"

    def __post_init__(self) -> None:
        _check_range("AddNoise: snr_db", self.snr_db)
        if self.color not in COLORS:
            raise ConfigError(
                f"AddNoise: color={self.color!r}; there is {', '.join(COLORS)}"
            )

    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Windows plus noise."""
        snr_db = _uniform(self.snr_db, (len(windows), 1, 1), windows, generator)
        power = windows.square().mean(dim=-1, keepdim=True)
        level = (power * 10 ** (-snr_db / 10)).sqrt()
        noise = _white_noise(windows, generator)
        if self.color != "white":
            noise = _colored(noise, COLORS[self.color])
        return windows + level * noise


@dataclass(frozen=True, slots=True)
class Gain(Transform):
    """Gain drawn for each window.

    Parameters
    ----------
    db : lowest and highest gain, dB of amplitude
    by_channel : draw for each channel, as for sensors of unequal sensitivity
    """

    db: Range
    by_channel: bool = False

    def __post_init__(self) -> None:
        _check_range("Gain: db", self.db)

    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Windows times their gains."""
        n_gains = 1
        if self.by_channel:
            n_gains = windows.shape[1]
        db = _uniform(self.db, (len(windows), n_gains, 1), windows, generator)
        return windows * 10 ** (db / 20)


@dataclass(frozen=True, slots=True)
class Shift(Transform):
    """Circular shift in time drawn for each window, the same for all channels.

    Parameters
    ----------
    samples : longest shift to either side; what leaves a window at one end enters at the other
    """

    samples: int

    def __post_init__(self) -> None:
        if self.samples < 0:
            raise ConfigError(f"Shift: samples={self.samples} must be at least 0")

    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Windows rolled along time."""
        n_batch, _, n_samples = windows.shape
        shift = torch.randint(
            -self.samples,
            self.samples + 1,
            (n_batch, 1, 1),
            generator=generator,
            device=_device(windows, generator),
        ).to(windows.device)
        sample = torch.arange(n_samples, device=windows.device)
        return _at(windows, (sample - shift) % n_samples)


@dataclass(frozen=True, slots=True)
class Resample(Transform):
    """Change of rate drawn for each window, as at another speed of the machine; length stays.

    Parameters
    ----------
    factor : lowest and highest factor of all frequencies, resonances of the housing too

    Notes
    -----
    Sample ``i`` of the result is the band-limited window at ``factor * i``. Where that lies
    beyond its end, the window begins again. Content that would pass half the sampling rate is
    removed. The error at a tone is below 0.4 % of its amplitude up to 0.4 of the sampling rate
    before the change, and 0.03 % up to 0.2.
    """

    factor: Range

    def __post_init__(self) -> None:
        _check_range("Resample: factor", self.factor)
        if self.factor[0] <= 0:
            raise ConfigError(f"Resample: factor={self.factor} must be above 0")

    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Windows read at another rate."""
        n_samples = windows.shape[-1]
        factor = _uniform(self.factor, (len(windows), 1, 1), windows, generator)
        spectrum = torch.fft.rfft(windows)
        bins = torch.arange(spectrum.shape[-1], device=windows.device)
        stays = bins * factor.clamp(min=1.0) < n_samples / 2
        n_points = POINTS_PER_SAMPLE * n_samples
        points = torch.fft.irfft(spectrum * (stays * POINTS_PER_SAMPLE), n=n_points)
        sample = torch.arange(n_samples, device=windows.device, dtype=torch.float64)
        place = sample * factor * POINTS_PER_SAMPLE
        before = place.floor()
        weights = _cubic_weights((place - before).to(windows.dtype))
        index = before.long() - 1
        result = torch.zeros_like(windows)
        for number, weight in enumerate(weights):
            result.addcmul_(weight, _at(points, (index + number) % n_points))
        return result


@dataclass(frozen=True, slots=True)
class DropChannels(Transform):
    """Channels set to zero, as of sensors that fail; one channel of a window always stays.

    Parameters
    ----------
    probability : of each channel of each window
    """

    probability: float

    def __post_init__(self) -> None:
        if not 0 <= self.probability <= 1:
            raise ConfigError(
                f"DropChannels: probability={self.probability} must be from 0 to 1"
            )

    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Windows without some channels."""
        draw = _uniform((0.0, 1.0), windows.shape[:2], windows, generator)
        stays = draw >= self.probability
        stays = stays | (draw == draw.amax(dim=1, keepdim=True))
        return windows * stays[..., None]


@dataclass(frozen=True, slots=True)
class ChooseChannels(Transform):
    """Some channels of each window, drawn at random: a sensor that sits anywhere.

    Parameters
    ----------
    n_channels : channels that stay, in the order of the window

    Raises
    ------
    ConfigError    when called on windows with fewer channels
    """

    n_channels: int = 1

    def __post_init__(self) -> None:
        if self.n_channels < 1:
            raise ConfigError(
                f"ChooseChannels: n_channels={self.n_channels} must be at least 1"
            )

    def changed(self, windows: Windows, generator: torch.Generator | None) -> Windows:
        """Windows (batch, n_channels, sample)."""
        if windows.shape[1] < self.n_channels:
            raise ConfigError(
                f"ChooseChannels: n_channels={self.n_channels}, and a window has "
                f"{windows.shape[1]}; give fewer"
            )
        draw = _uniform((0.0, 1.0), windows.shape[:2], windows, generator)
        chosen = draw.argsort(dim=1)[:, : self.n_channels].sort(dim=1).values
        index = chosen[..., None].expand(-1, -1, windows.shape[-1])
        return windows.gather(1, index)


def _check_range(name: str, given: Range) -> None:
    if len(given) != 2 or not all(map(math.isfinite, given)) or given[0] > given[1]:
        raise ConfigError(
            f"{name}={given} must be two numbers (low, high), low not above high"
        )


def _device(windows: Windows, generator: torch.Generator | None) -> torch.device:
    """Device on which draws are made."""
    if generator is None:
        return windows.device
    return generator.device


def _uniform(
    interval: Range,
    shape: Sequence[int],
    windows: Windows,
    generator: torch.Generator | None,
) -> torch.Tensor:
    """Numbers of an interval, of the type and on the device of the windows."""
    low, high = interval
    draw = torch.rand(
        tuple(shape),
        generator=generator,
        device=_device(windows, generator),
        dtype=windows.dtype,
    )
    return (low + (high - low) * draw).to(windows.device)


def _white_noise(windows: Windows, generator: torch.Generator | None) -> torch.Tensor:
    """Normal numbers of the shape, type and device of the windows."""
    draw = torch.randn(
        windows.shape,
        generator=generator,
        device=_device(windows, generator),
        dtype=windows.dtype,
    )
    return draw.to(windows.device)


def _colored(noise: torch.Tensor, exponent: float) -> torch.Tensor:
    """White noise of mean square 1 with a power density that falls as f^-exponent.

    The expected mean square stays 1; the mean over the samples is 0.
    """
    n_samples = noise.shape[-1]
    frequency = torch.fft.rfftfreq(n_samples, device=noise.device, dtype=noise.dtype)
    density = torch.zeros_like(frequency)
    density[1:] = frequency[1:] ** -exponent
    # irfft counts each frequency twice, but for that of half the sampling rate
    share = torch.full_like(density, 2.0)
    if n_samples % 2 == 0:
        share[-1] = 1.0
    density = density * n_samples / (share * density).sum()
    return torch.fft.irfft(torch.fft.rfft(noise) * density.sqrt(), n=n_samples)


def _cubic_weights(place: torch.Tensor) -> tuple[torch.Tensor, ...]:
    """Weights of the points at -1, 0, 1 and 2 for a place from 0 to 1: Lagrange's polynomials."""
    left, right, far = place + 1, place - 1, place - 2
    return (
        -place * right * far / 6,
        left * right * far / 2,
        -left * place * far / 2,
        left * place * right / 6,
    )


def _at(signals: torch.Tensor, index: torch.Tensor) -> torch.Tensor:
    """Samples (batch, channel, k) of signals at an index (batch, 1, k)."""
    return signals.gather(-1, index.expand(-1, signals.shape[1], -1))
