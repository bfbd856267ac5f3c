"""Data module: loaders of one split, in the order in which Lightning's trainer calls."""

import pytest
import torch
from fake_dataset import CLASSES, FakeDataset
from torch import nn

from diagnose.data import Gain, VibrationDataModule, VibrationDataset
from gensig.errors import ConfigError, DatasetError

WINDOW = {"window_samples": 700, "stride_samples": 300}
CPU = torch.device("cpu")


def data_module(data=None, protocol="by_unit", **changes):
    if data is None:
        data = FakeDataset(n_units=8)
    return VibrationDataModule(
        data, protocol, **{**WINDOW, "batch_size": 16, **changes}
    )


def content(loader):
    windows, labels = zip(*loader, strict=True)
    return torch.cat(windows), torch.cat(labels)


def stored(data, subset, **changes):
    windows = VibrationDataset(data, "by_unit", subset, **{**WINDOW, **changes})
    items = [windows[index] for index in range(len(windows))]
    return torch.stack([item[0] for item in items]), [item[1] for item in items]


def transferred(module, batch):
    """A batch as the trainer hands it to the network."""
    batch = module.on_before_batch_transfer(batch, 0)
    batch = module.transfer_batch_to_device(batch, CPU, 0)
    return module.on_after_batch_transfer(batch, 0)


def test_a_network_learns_in_the_trainers_order_of_calls():
    torch.manual_seed(0)
    module = data_module(FakeDataset(noise=0.1), seed=1)
    net = nn.Sequential(
        *(nn.Conv1d(1, 8, 32, 4), nn.ReLU(), nn.AdaptiveMaxPool1d(1), nn.Flatten()),
        nn.Linear(8, len(CLASSES)),
    )
    optimizer = torch.optim.Adam(net.parameters(), lr=1e-2)
    module.trainer = object()
    module.prepare_data()
    module.setup("fit")
    losses = []
    for _ in range(6):
        total = 0.0
        for batch in module.train_dataloader():
            windows, labels = transferred(module, batch)
            loss = nn.functional.cross_entropy(net(windows), labels)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            total += loss.item()
        with torch.inference_mode():
            batches = [transferred(module, batch) for batch in module.val_dataloader()]
            answers = [net(windows).argmax(1) == label for windows, label in batches]
        losses.append(total)
    checkpoint = module.state_dict()
    module.teardown("fit")
    assert losses[-1] < 0.7 * losses[0]
    assert float(torch.cat(answers).float().mean()) > 0.4  # chance is 0.25
    module.load_state_dict(checkpoint)
    module.setup("test")
    with torch.inference_mode():
        labels = [transferred(module, batch)[1] for batch in module.test_dataloader()]
    module.teardown("test")
    assert torch.cat(labels).tolist() == module.windows["test"].label.tolist()


def test_loaders_hold_the_windows_of_their_subset_each_once():
    data = FakeDataset(n_units=8)
    module = data_module(data)
    module.setup()
    loaders = {
        "validation": module.val_dataloader(),
        "test": module.test_dataloader(),
    }
    for subset, loader in loaders.items():
        windows, labels = stored(data, subset)
        result = content(loader)
        assert torch.equal(result[0], windows)
        assert result[1].tolist() == labels
    windows, labels = stored(data, "train")
    result = content(module.train_dataloader())
    assert not torch.equal(result[0], windows)
    keys = [window.numpy().tobytes() for window in windows]
    assert sorted(window.numpy().tobytes() for window in result[0]) == sorted(keys)
    assert torch.equal(*(content(module.predict_dataloader())[0] for _ in range(2)))


@pytest.mark.parametrize(
    ("stage", "subsets"),
    [
        ("fit", {"train", "validation"}),
        ("validate", {"validation"}),
        ("test", {"test"}),
        ("predict", {"test"}),
        (None, {"train", "validation", "test"}),
    ],
)
def test_a_stage_plans_what_it_reads(stage, subsets):
    module = data_module()
    module.setup(stage)
    assert set(module.windows) == subsets


@pytest.mark.parametrize("n_workers", [0, 2])
def test_transforms_change_training_batches_only(n_workers):
    data = FakeDataset(n_units=8)
    plain = data_module(data, seed=3)
    changed = data_module(data, seed=3, transform=Gain((20, 20)), num_workers=n_workers)
    for module in (plain, changed):
        module.setup()
    expected = content(plain.train_dataloader())
    result = content(changed.train_dataloader())
    torch.testing.assert_close(result[0], 10 * expected[0])
    assert torch.equal(result[1], expected[1])
    for name in ("val_dataloader", "test_dataloader", "predict_dataloader"):
        pair = [content(getattr(each, name)())[0] for each in (plain, changed)]
        assert torch.equal(*pair)


def test_a_seed_decides_the_order_which_differs_between_epochs():
    def passes(seed):
        module = data_module(seed=seed)
        module.setup("fit")
        return [content(module.train_dataloader())[0] for _ in range(2)]

    first, again, other = passes(1), passes(1), passes(2)
    assert all(map(torch.equal, first, again))
    assert not torch.equal(*first)
    assert not torch.equal(first[0], other[0])


def test_validation_and_test_have_a_stride_of_their_own():
    data = FakeDataset(n_units=8)
    module = data_module(data, test_stride_samples=700)
    module.setup()
    expected = stored(data, "test", stride_samples=700)[0]
    assert torch.equal(content(module.test_dataloader())[0], expected)
    assert len(module.windows["train"]) == len(stored(data, "train")[1])


def test_targets_and_metadata_reach_the_batches():
    module = data_module(target="severity", return_metadata=True)
    module.setup("test")
    batch = transferred(module, next(iter(module.test_dataloader())))
    assert batch[1].dtype == torch.float32
    assert torch.equal(batch[1].double(), batch[2]["severity"].float().double())
    assert all(isinstance(name, str) for name in batch[2]["record_id"])


def test_a_batch_goes_to_the_device_with_all_its_tensors():
    module = data_module()
    batch = [torch.zeros(2), {"speed_rpm": torch.ones(2), "unit_id": ["a", "b"]}]
    moved = module.transfer_batch_to_device(batch, torch.device("meta"))
    assert moved[0].device.type == moved[1]["speed_rpm"].device.type == "meta"
    assert moved[1]["unit_id"] == ["a", "b"]


def test_hyperparameters_are_plain_and_make_the_same_module():
    module = data_module("runs/some", channels=("x",), seed=4, transform=Gain((0, 1)))
    hparams = module.hparams
    plain = (int, str, list, bool, type(None))
    assert all(isinstance(value, plain) for value in hparams.values())
    assert hparams.pop("training_transform") == repr(module.transform)
    assert VibrationDataModule(**hparams).hparams.items() >= hparams.items()
    assert hparams.pop("channels") == list(module.channels)
    for name, value in hparams.items():
        assert getattr(module, name) == value


def test_a_checkpoint_of_other_data_is_refused():
    checkpoint = data_module().state_dict()
    with pytest.raises(ConfigError, match="trained with window_samples = 700, and"):
        data_module(window_samples=500).load_state_dict(checkpoint)
    with pytest.raises(ConfigError, match="trained with class_names = "):
        data_module(classes=["healthy", "crack"]).load_state_dict(checkpoint)


def test_mistakes_are_refused(tmp_path):
    module = data_module()
    with pytest.raises(ConfigError, match="stage 'train'; there is fit, validate"):
        module.setup("train")
    with pytest.raises(ConfigError, match="no train windows are planned; call setup"):
        module.train_dataloader()
    with pytest.raises(DatasetError):
        data_module(tmp_path).prepare_data()
    with pytest.raises(ConfigError, match="no protocol 'by_units'"):
        data_module(protocol="by_units").setup()
