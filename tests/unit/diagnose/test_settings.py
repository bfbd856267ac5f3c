"""Settings of a training: refusals in one line, and values that may be left out."""

import subprocess
import sys

import pytest
from small_studies import settings_of

from diagnose.commands.train import _expand
from gensig.errors import ConfigError

WHOLE = "must be a whole number of at least 1"
LIST = "must be false or a list of different names"
REFUSALS = [
    ("epochs=0", f"epochs {WHOLE}"),
    ("model.training.examples=0.5", f"examples {WHOLE}"),
    ("patience=-1", "patience must be a whole number of at least 0"),
    ("n_threads=0", f"n_threads {WHOLE}"),
    ("window_samples=0", f"window_samples {WHOLE}"),
    ("window_samples=1.5", WHOLE),
    ("window_samples=long", WHOLE),
    ("stride_samples=-1", f"stride_samples {WHOLE}"),
    ("batch_size=1", "must be a whole number of at least 2"),
    ("seeds=[]", "seeds must be a list"),
    ("seeds=null", "seeds must be a list"),
    (
        "seeds=3",
        r"'seeds=\[3\]' trains once, with seed 3; 'seeds=\[0,1,2\]' trains three",
    ),
    ("epochs=[3]", f"epochs {WHOLE}, not"),
    ("epochs=2.5e0", f"epochs {WHOLE}"),
    ("seeds=[1,1]", "seeds must be a list of different"),
    ("epoch_fraction=2", "epoch_fraction must be a number from 0 to 1"),
    ("learning_rate=high", "learning_rate must be a number"),
    ("+extra=1", "knows no key 'extra'"),
    ("shuffle_control=3", "shuffle_control must be true or false"),
    ("metadata_probe=1", "metadata_probe must be true or false, not 1"),
    ("tensorboard=2", "tensorboard must be true or false, not 2"),
    ("device=tpu", "device must be one of auto, cpu, cuda"),
    ("task=cooking", "task must be one of classes, remaining_life"),
    ("oracle=true", "oracle must be auto or false"),
    ("sham=3", "sham must be the folder of a data set made with plan.sham=true"),
    ("features=some", "features must be basic or all"),
    ("baselines=[indicator]", "no baseline 'indicator'; did you mean 'indicators'"),
    ("baselines=[reference]", "no baseline 'reference'; there is .*, sound_record"),
    ("baselines=[indicators,indicators]", f"baselines {LIST}"),
    ("baselines=true", f"baselines {LIST}"),
    ("heads=[tooth]", "no head 'tooth'; there is severity, gear"),
    ("heads=[gear,gear]", f"heads {LIST}"),
    ("classes={a: 1}", r"classes must be a list, for instance classes=\[a,b\]"),
    *(
        (f"sampling_rate_hz={value}", "sampling_rate_hz must be null or a number")
        for value in ("fast", "0", "-5", "true")
    ),
    ("sampling_rate_hz=inf", "sampling_rate_hz = inf must be a finite number"),
    ("remaining_life.early_life_h=0", "early_life_h must be a number above 0, not 0"),
    ("remaining_life.early_life_share=0", "early_life_share must be a number above 0"),
    ("remaining_life.coverage=1", "coverage must be a number above 0 and below 1"),
    ("remaining_life.with_age=2", "with_age must be true or false"),
    ("remaining_life=3", "remaining_life must hold"),
]


@pytest.mark.parametrize(("override", "message"), REFUSALS)
def test_mistakes_are_refused(override, message):
    with pytest.raises(ConfigError, match=message):
        settings_of(override)


def test_every_run_of_a_sweep_takes_options_of_one_s_own(tmp_path):
    folder = tmp_path / "mine" / "model"
    folder.mkdir(parents=True)
    (folder / "small.yaml").write_text("name: cnn\nkind: small_cnn\nwidths: [4, 4]\n")
    words = ["data=a", f"out={tmp_path / 'out'}", "model=glob([cnn,small])"]
    shipped, small = _expand(words, str(tmp_path / "mine"))
    assert list(small.config["model"]["widths"]) == [4, 4]
    assert list(shipped.config["model"]["widths"]) != [4, 4]


@pytest.mark.parametrize(
    ("override", "expected"),
    [("false", ()), ("[]", ()), ("indicators", ("indicators",))],
)
def test_baselines_may_be_left_out_or_be_one(override, expected):
    assert settings_of(f"baselines={override}").baselines == expected


def test_settings_are_refused_without_loading_torch():
    """A mistake in a setting is answered at once; torch takes seconds to load."""
    code = (
        "import diagnose.settings, sys; print({'torch', 'sklearn'} & set(sys.modules))"
    )
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert shown.stdout.strip() == "set()"


@pytest.mark.parametrize(
    ("n_drawn", "words", "epochs"),
    [
        (280, (), 30),
        (1000, (), 10),
        (50_000, (), 8),
        (1000, ("epochs=30",), 30),
        (1000, ("model=cnn",), 14),
        (1000, ("model.training.epochs=3",), 3),
    ],
)
def test_many_examples_need_fewer_epochs_unless_epochs_are_given(
    n_drawn, words, epochs
):
    assert settings_of(*words).schedule.epochs_of(n_drawn) == epochs


def test_counts_with_a_point_or_an_exponent_are_read():
    settings = settings_of("epochs=1e1", "n_bootstrap=2e2", "window_samples=4096.0")
    assert (settings.epochs, settings.n_bootstrap) == (10, 200)
    assert settings.window_samples == 4096
