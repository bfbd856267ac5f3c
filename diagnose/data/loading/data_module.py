"""Data module: the data sets and loaders of one split, with the hooks of Lightning's trainer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
import torch.utils.data

from diagnose.data.loading.stored import VibrationDataset
from diagnose.data.loading.transforms import AnyTransform, transformed
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

# Subsets of a split that a stage of the trainer reads.
STAGES = {
    "fit": ("train", "validation"),
    "validate": ("validation",),
    "test": ("test",),
    "predict": ("test",),
}


class VibrationDataModule:
    """Loaders of the training, validation and test windows of one split.

    It has the methods and attributes of a ``LightningDataModule`` without depending on that
    package. Lightning's trainer asks for its own class too, by
    ``class Data(VibrationDataModule, LightningDataModule): pass``.

    Parameters
    ----------
    data : data set, or its folder, which `setup` opens and `teardown` closes
    protocol : name of the split, one of ``dataset.protocols``
    window_samples, stride_samples : length of a window and step from one to the next
    test_stride_samples : step of the validation and test windows; None for ``stride_samples``
    batch_size, num_workers : of all loaders
    channels, classes, normalise, target, return_metadata : as for `VibrationDataset`
    transform : function of a training batch (batch, channel, sample), called in the workers.
        Validation, test and prediction batches stay as they are
    seed : of the order of the training windows and of the workers' draws; None for that of torch
    loader_options : further arguments of every ``torch.utils.data.DataLoader``

    Attributes
    ----------
    trainer : Any                  set by Lightning
    hparams : dict                 the arguments above as numbers and texts
    windows : dict                 subset -> `VibrationDataset`, filled by `setup`

    Notes
    -----
    Without workers a transform draws from the generator of torch: ``torch.manual_seed`` makes
    it repeatable.
    """

    trainer: Any = None
    prepare_data_per_node = True
    allow_zero_length_dataloader_with_multiple_devices = False

    def __init__(
        self,
        data: Dataset | str | Path,
        protocol: str,
        *,
        window_samples: int,
        stride_samples: int,
        test_stride_samples: int | None = None,
        batch_size: int = 64,
        num_workers: int = 0,
        channels: Sequence[str] | None = None,
        classes: Sequence[str] | None = None,
        normalise: str = "rms",
        target: str = "class",
        return_metadata: bool = False,
        transform: AnyTransform | None = None,
        seed: int | None = None,
        loader_options: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__()  # of Lightning's class, where that is the second base
        self.data, self.protocol = data, protocol
        self.window_samples, self.stride_samples = window_samples, stride_samples
        self.test_stride_samples = test_stride_samples
        self.batch_size, self.num_workers = batch_size, num_workers
        self.channels, self.classes = channels, classes
        self.normalise, self.target = normalise, target
        self.return_metadata, self.transform, self.seed = (
            return_metadata,
            transform,
            seed,
        )
        self.loader_options = dict(loader_options or {})
        self.windows: dict[str, VibrationDataset] = {}
        self._dataset: Dataset | None = None
        self._order = torch.Generator()
        if seed is not None:
            self._order.manual_seed(seed)

    @property
    def hparams(self) -> dict[str, Any]:
        """Arguments as numbers and texts, which a logger or a checkpoint can store."""
        folder = self.data
        if not isinstance(folder, str | Path):
            folder = folder.folder
        return {
            "data": str(folder),
            "protocol": self.protocol,
            "window_samples": self.window_samples,
            "stride_samples": self.stride_samples,
            "test_stride_samples": self.test_stride_samples,
            "batch_size": self.batch_size,
            "num_workers": self.num_workers,
            "channels": _names(self.channels),
            "classes": _names(self.classes),
            "normalise": self.normalise,
            "target": self.target,
            "return_metadata": self.return_metadata,
            "seed": self.seed,
            "training_transform": repr(self.transform),
        }

    @property
    def hparams_initial(self) -> dict[str, Any]:
        """``hparams``: Lightning's loggers ask for them by this name."""
        return self.hparams

    @property
    def dataset(self) -> Dataset:
        """The data set, opened on first use."""
        if self._dataset is None:
            self._dataset = _opened(self.data)
        return self._dataset

    @property
    def class_names(self) -> tuple[str, ...]:
        """Names that class targets are indices of."""
        return tuple(self.classes or self.dataset.class_names)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names along the channel axis of a window."""
        return tuple(self.channels or self.dataset.channel_names)

    def prepare_data(self) -> None:
        """Refuse a folder that is no data set, before any process is started.

        Raises
        ------
        DatasetError    for a folder that is no complete data set
        """
        if isinstance(self.data, str | Path):
            _opened(self.data).close()

    def setup(self, stage: str | None = None) -> None:
        """Plan the windows of a stage: ``fit``, ``validate``, ``test``, ``predict``; all if None.

        Raises
        ------
        ConfigError    for another stage, and what `VibrationDataset` refuses
        """
        subsets: Sequence[str] = ("train", "validation", "test")
        if stage is not None:
            name = str(getattr(stage, "value", stage))  # an enumeration in Lightning
            if name not in STAGES:
                raise ConfigError(f"stage {name!r}; there is {', '.join(STAGES)}")
            subsets = STAGES[name]
        for subset in subsets:
            if subset not in self.windows:
                self.windows[subset] = self._planned(subset)

    def teardown(self, stage: str | None = None) -> None:
        """Close the files of a data set that was opened here; its windows can still be read."""
        if self._dataset is not None and self._dataset is not self.data:
            self._dataset.close()

    def train_dataloader(self) -> torch.utils.data.DataLoader[Any]:
        """Loader of the training windows in random order, with ``transform``."""
        return self._loader(
            "train",
            shuffle=True,
            generator=self._generator(),
            collate_fn=_Collate(self.transform),
        )

    def val_dataloader(self) -> torch.utils.data.DataLoader[Any]:
        """Loader of the validation windows in the order of the plan."""
        return self._loader("validation")

    def test_dataloader(self) -> torch.utils.data.DataLoader[Any]:
        """Loader of the test windows in the order of the plan."""
        return self._loader("test")

    def predict_dataloader(self) -> torch.utils.data.DataLoader[Any]:
        """Loader of the windows to predict: those of the test part."""
        return self._loader("test")

    def state_dict(self) -> dict[str, Any]:
        """Facts that a checkpoint keeps, so that other data cannot take their place."""
        return {
            "class_names": list(self.class_names),
            "channel_names": list(self.channel_names),
            "window_samples": self.window_samples,
            "target": self.target,
        }

    def load_state_dict(self, state_dict: Mapping[str, Any]) -> None:
        """Compare the facts of a checkpoint with this module.

        Raises
        ------
        ConfigError    where classes, channels, window length or target are others
        """
        present = self.state_dict()
        for name, stored in state_dict.items():
            if name in present and present[name] != stored:
                raise ConfigError(
                    f"the checkpoint was trained with {name} = {stored}, and the data module "
                    f"has {present[name]}; give it those of the checkpoint"
                )

    def on_before_batch_transfer(self, batch: Any, dataloader_idx: int = 0) -> Any:
        """The batch, unchanged."""
        return batch

    def transfer_batch_to_device(
        self, batch: Any, device: torch.device | str, dataloader_idx: int = 0
    ) -> Any:
        """The batch on another device; texts of its metadata stay as they are."""
        if isinstance(batch, torch.Tensor):
            return batch.to(device, non_blocking=True)
        if isinstance(batch, Mapping):
            return {
                name: self.transfer_batch_to_device(part, device, dataloader_idx)
                for name, part in batch.items()
            }
        if isinstance(batch, list | tuple):
            parts = [
                self.transfer_batch_to_device(part, device, dataloader_idx)
                for part in batch
            ]
            return type(batch)(parts)
        return batch

    def on_after_batch_transfer(self, batch: Any, dataloader_idx: int = 0) -> Any:
        """The batch, unchanged."""
        return batch

    def on_exception(self, exception: BaseException) -> None:
        """Close what was opened, as at the end."""
        self.teardown()

    def _planned(self, subset: str) -> VibrationDataset:
        stride = self.stride_samples
        if subset != "train" and self.test_stride_samples is not None:
            stride = self.test_stride_samples
        return VibrationDataset(
            self.dataset,
            self.protocol,
            subset,
            window_samples=self.window_samples,
            stride_samples=stride,
            channels=self.channels,
            classes=self.classes,
            normalise=self.normalise,
            target=self.target,
            return_metadata=self.return_metadata,
        )

    def _loader(self, subset: str, **options: Any) -> torch.utils.data.DataLoader[Any]:
        if subset not in self.windows:
            raise ConfigError(f"no {subset} windows are planned; call setup() first")
        return torch.utils.data.DataLoader(
            self.windows[subset],
            batch_size=self.batch_size,
            num_workers=self.num_workers,
            **{**options, **self.loader_options},
        )

    def _generator(self) -> torch.Generator | None:
        """Source of the order; its state goes on from one epoch to the next."""
        if self.seed is None:
            return None
        return self._order


@dataclass(frozen=True, slots=True)
class _Collate:
    """Batch of items, whose windows a transform changes; can be pickled."""

    transform: AnyTransform | None

    def __call__(self, items: Sequence[Any]) -> list[Any]:
        windows, *facts = torch.utils.data.default_collate(list(items))
        return [transformed(windows, self.transform), *facts]


def _opened(data: Dataset | str | Path) -> Dataset:
    if not isinstance(data, str | Path):
        return data
    # here, because HDF5 is not needed by sets in memory
    from gensig.dataset.reader import open_dataset

    return open_dataset(data)


def _names(chosen: Sequence[str] | None) -> list[str] | None:
    if chosen is None:
        return None
    return list(chosen)
