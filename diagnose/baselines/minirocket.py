"""MiniRocket: ridge regression on shares of positive values of fixed convolutions.

The transform is implemented here. The libraries with it depend on many others (sktime, aeon) or
have no second release.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import Baseline, Input, MethodText, Parts, Role, Source
from diagnose.baselines.estimators import record_accuracy
from diagnose.baselines.features import FeatureTable
from diagnose.baselines.window_features import over_stretches
from diagnose.data.windows import FloatArray, WindowSet

if TYPE_CHECKING:
    import torch

KERNEL_LENGTH = 9
# (84, 9): weights 2 at three taps, all ways to choose them, and -1 elsewhere
_TAPS = np.array(list(itertools.combinations(range(KERNEL_LENGTH), 3)))
KERNELS = 3.0 * np.eye(KERNEL_LENGTH)[_TAPS].sum(axis=1) - 1.0
MAX_DILATIONS = 32
GOLDEN_RATIO = (1 + np.sqrt(5)) / 2
N_EXAMPLES = 512  # windows that thresholds may be taken from
PENALTIES = np.logspace(5, -1, 7)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bank:
    """All kernels at one dilation.

    Attributes
    ----------
    dilation : samples from one weight to the next
    weight : (84, channel, 9) zero for the channels outside the set of a kernel
    bias : (84, feature) thresholds
    padded : (84,) True if positions count at which the kernel reaches beyond the window
    """

    dilation: int
    weight: torch.Tensor
    bias: NDArray[np.float32]
    padded: NDArray[np.bool_]


def fit_minirocket(
    windows: FloatArray, *, n_features: int, rng: np.random.Generator
) -> list[Bank]:
    """Choose dilations, channels and thresholds.

    Parameters
    ----------
    windows : (window, channel, sample) training windows, from which the thresholds are taken
    n_features : rounded down to a multiple of 84
    rng : draws channels and the windows that give the thresholds

    Source: Dempster, Schmidt & Webb (2021), "MiniRocket: a very fast (almost) deterministic
    transform for time series classification", KDD; several channels as in the authors' later
    code: each kernel uses a drawn set of channels, the logarithm of whose number is uniform.
    """
    import torch

    n_windows, n_channels, n_samples = windows.shape
    n_kernels = len(KERNELS)
    per_kernel = max(n_features // n_kernels, 1)
    quantile = np.arange(1, per_kernel * n_kernels + 1) * GOLDEN_RATIO % 1
    banks, used = [], 0
    for index, (dilation, count) in enumerate(_dilations(n_samples, per_kernel)):
        weight = _kernels_on_channels(n_channels, rng)
        example = torch.from_numpy(windows[rng.integers(n_windows, size=n_kernels)])
        output = torch.nn.functional.conv1d(
            example.reshape(1, -1, n_samples),
            weight,
            dilation=dilation,
            padding=4 * dilation,
            groups=n_kernels,
        )[0]
        shares = quantile[used : used + n_kernels * count].reshape(n_kernels, count)
        rows = zip(output.numpy(), shares, strict=True)
        bias = np.stack([np.quantile(values, share) for values, share in rows])
        banks.append(
            Bank(
                dilation=dilation,
                weight=weight,
                bias=bias.astype(np.float32),
                padded=(index + np.arange(n_kernels)) % 2 == 0,
            )
        )
        used += n_kernels * count
    return banks


def minirocket_features(windows: FloatArray, banks: list[Bank]) -> FloatArray:
    """(window, feature) share of positive values of every convolution less its threshold.

    The windows are float32. Two at a time stay in the cache of a processor. Sums of bytes are ten
    times as fast in numpy as in torch.
    """
    import torch

    rows = []
    for block in torch.from_numpy(windows).split(2):
        shares = [_shares(block, bank) for bank in banks]
        rows.append(np.concatenate(shares, axis=1))
    return np.concatenate(rows)


def _shares(windows: torch.Tensor, bank: Bank) -> FloatArray:
    """(window, feature) of one dilation, kernel by kernel."""
    import torch

    n_samples, margin = windows.shape[-1], 4 * bank.dilation
    padded = torch.nn.functional.pad(windows, (margin, margin))
    taps = [
        padded[..., tap * bank.dilation :][..., :n_samples]
        for tap in range(KERNEL_LENGTH)
    ]
    columns = torch.stack(taps, dim=2).flatten(1, 2)
    output = torch.matmul(bank.weight.flatten(1), columns).numpy()
    shares = np.empty((len(windows), *bank.bias.shape), dtype=np.float32)
    for ends, span in ((True, slice(None)), (False, slice(margin, n_samples - margin))):
        kernels = np.flatnonzero(bank.padded == ends)
        part = output[:, kernels, span]
        for index, bias in enumerate(bank.bias[kernels].T):
            above = (part > bias[:, None]).view(np.uint8)
            count = above.sum(axis=-1, dtype=np.uint32)
            shares[:, kernels, index] = count / part.shape[-1]
    return shares.reshape(len(windows), -1)


def _dilations(n_samples: int, per_kernel: int) -> list[tuple[int, int]]:
    """Dilations and the number of features a kernel at each.

    They are evenly spaced on a logarithmic scale, up to the whole window.
    """
    n_exponents = min(per_kernel, MAX_DILATIONS)
    longest = max((n_samples - 1) / (KERNEL_LENGTH - 1), 1)
    values = np.floor(np.logspace(0, np.log2(longest), n_exponents, base=2)).astype(int)
    dilation, count = np.unique(values, return_counts=True)
    count = np.floor(count * per_kernel / n_exponents).astype(int)
    count[np.arange(per_kernel - count.sum()) % count.size] += 1
    return [(int(d), int(n)) for d, n in zip(dilation, count, strict=True) if n > 0]


def _kernels_on_channels(n_channels: int, rng: np.random.Generator) -> torch.Tensor:
    """(84, channel, 9) the kernels, each on its drawn channels."""
    import torch

    most = min(n_channels, KERNEL_LENGTH)
    n_used = np.floor(2 ** rng.uniform(0, np.log2(most + 1), len(KERNELS))).astype(int)
    used = np.stack([rng.permutation(n_channels) < n for n in n_used])
    return torch.from_numpy((KERNELS[:, None, :] * used[:, :, None]).astype(np.float32))


def rocket_tables(sets: Mapping[str, WindowSet], *, n_features: int) -> Parts:
    """Features of the stretches of every subset, means over their windows.

    Everything is chosen on the training windows. The draws are those of seed 0: the features
    hardly depend on them.
    """
    train = sets["train"]
    rng = np.random.default_rng(0)
    examples = np.sort(rng.permutation(len(train))[:N_EXAMPLES])
    banks = fit_minirocket(train.cut(examples), n_features=n_features, rng=rng)

    def features(block: NDArray[np.float32]) -> FloatArray:
        return minirocket_features(block, banks)

    def table(subset: str) -> FeatureTable:
        return over_stretches(sets[subset], features, "rocket")

    return Parts.of(table, sets)


def _make(source: Source) -> Parts:
    return rocket_tables(source.windows(), n_features=source.minirocket_features)


ROCKET_INPUT = Input(name="rockets", make=_make)


@final
class MiniRocket(Baseline):
    """Ridge regression on class membership, features standardised."""

    text = MethodText(
        name="minirocket",
        label="MiniRocket",
        card_label="MiniRocket",
        meaning="ridge regression on the shares of positive values of fixed convolutions (Dempster "
        "et al. 2021), mean over the windows; the penalty is chosen on validation machines.",
    )
    role = Role.RIVAL
    reads = ROCKET_INPUT
    _model: Any
    _n_classes: int

    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Fit with each penalty and keep the best one; the largest wins ties."""
        self._n_classes = n_classes
        scored = []
        for penalty in PENALTIES:
            self._model = _ridge(penalty).fit(train.values, train.label)
            accuracy = record_accuracy(self.predict_proba(validation), validation)
            scored.append((accuracy, penalty, self._model))
        _, best_penalty, self._model = max(scored, key=lambda row: row[0])
        return f"ridge, penalty {best_penalty:g}"

    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """Softmax (row, class) of the scores, which keeps their order."""
        from scipy.special import softmax

        score = self._model.decision_function(table.values)
        if score.ndim == 1:  # two classes: one score, positive for the second
            score = np.stack([-score, score], axis=1)
        probability = np.zeros((len(table.values), self._n_classes))
        probability[:, self._model.classes_] = softmax(score, axis=1)
        return probability


def _ridge(penalty: float) -> Any:
    from sklearn.linear_model import RidgeClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(
        StandardScaler(), RidgeClassifier(alpha=penalty, class_weight="balanced")
    )
