"""The least run of a command of a page: its words, with fewer and shorter records and trainings."""

from collections.abc import Mapping, Sequence

Values = Mapping[str, str]

DURATION = "operating.duration_s"
FEW = {
    DURATION: "0.5",
    "plan.n_records": "24",
    "plan.n_units": "12",
    "executor.n_workers": "1",
}
LINES = {**FEW, DURATION: "0.25", "plan.n_records": "8", "plan.n_units": "4"}
ENGINES = {
    **FEW,
    DURATION: "0.1",
    "plan.n_records": "4",
    "plan.n_units": "2",
    "plan.n_gearboxes": "2",
}
TRAINED_ENGINES = {
    **ENGINES,
    "plan.n_records": "12",
    "plan.n_units": "3",
    "plan.n_gearboxes": "3",
    "plan.classes": "[healthy,missing_tooth]",
}
LIVES = {
    **FEW,
    DURATION: "0.1",
    "plan.n_records": "null",
    "plan.n_units": "24",
    "life.snapshot_count": "3",
}
FEW_SLICES = {"mesh.n_slices": "8"}
# experiment -> values of its smallest data set
SETS: Mapping[str, Values] = {
    "two_stage": LINES,
    "engine_broken_tooth": ENGINES,
    "engine_test_point": TRAINED_ENGINES,
    "helical": {**FEW, **FEW_SLICES},
    "my_records": LINES,
    "reducer2": LINES,
    "run_to_failure": LIVES,
}
TRAINING: Values = {
    "epochs": "1",
    "seeds": "[0]",
    "epoch_fraction": "0.05",
    "n_bootstrap": "20",
    "n_threads": "1",
}
# what the words of a command may say otherwise
QUIET: Values = {
    "baselines": "[tooth_logistic]",
    "shuffle_control": "false",
    "metadata_probe": "false",
}
# verb -> flags of its least run, with their values, in place of those that are given
FLAGS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "forced-response": {"--time": ("0.2",), "--sweep": ("1600", "1700", "1")},
    "run-up": {"--against": ("modification=beihang_both",)},
    "detectability": {
        "--sizes": ("1", "3"),
        "--snrs": ("10", "20"),
        "--speeds": ("600", "1200"),
    },
    "modify-flank": {"--torques": ("100",), "--misalignments": ("0",)},
}
# verb -> flags that are added
ADDED: Mapping[str, tuple[str, ...]] = {
    "detectability": ("--n-units", "4", "--workers", "1", f"{DURATION}=0.25"),
    "implant": ("--records", "60"),
    "modify-flank": ("--points", "1"),
    "tune-damper": ("--run", "1600", "1700", "50", "--nodes", "45"),
}


def value_of(words: Sequence[str], key: str) -> str:
    """Value of an override; empty where it is not among the words."""
    return next(
        (word.partition("=")[2] for word in words if word.startswith(f"{key}=")), ""
    )


def values_behind(words: Sequence[str], flag: str) -> list[str]:
    """Values behind a flag, up to the next flag; none where it is not among the words."""
    if flag not in words:
        return []
    values = words[words.index(flag) + 1 :]
    end = next((k for k, word in enumerate(values) if word.startswith("--")), None)
    return list(values[:end])


def with_values(words: Sequence[str], values: Values) -> list[str]:
    """Words with these values of overrides in place of their own."""
    kept = [word for word in words if word.partition("=")[0] not in values]
    return [*kept, *[f"{key}={value}" for key, value in values.items()]]


def _least_set(words: Sequence[str]) -> list[str]:
    values = dict(SETS.get(value_of(words, "experiment"), FEW))
    if value_of(words, "life"):
        n_classes = value_of(words, "plan.classes").count(",") + 1
        values |= {**LIVES, "plan.n_units": str(n_classes)}
    if value_of(words, "plan.n_repeats"):
        values["plan.n_records"] = "48"
    if value_of(words, "operating") or value_of(words, "operating.turns"):
        del values[DURATION]
    if "-m" in words:
        values["plan.n_records"] = "4"
        del values["plan.n_units"]
    if "--config" in words or value_of(words, "executor.shard_index"):
        return [*words]
    return with_values(words, values)


def _least_plan(words: Sequence[str]) -> list[str]:
    """A frozen plan is a set that is not made yet; others are as small as they are."""
    if "--freeze" in words:
        return _least_set(words)
    return [*words]


def _least_training(words: Sequence[str]) -> list[str]:
    values = {**TRAINING}
    if value_of(words, "task") != "remaining_life":
        values |= {key: QUIET[key] for key in QUIET if not value_of(words, key)}
    if value_of(words, "model.redraws"):
        values["model.redraws"] = "1"
    return with_values(words, values)


def _least_record(words: Sequence[str]) -> list[str]:
    """A record whose speed changes is short, whatever its course lasts."""
    values = {}
    if value_of(words, "operating"):
        values[DURATION] = "1"
    if value_of(words, "system") == "helical_pair":
        values |= FEW_SLICES
    return with_values(words, values)


def _least_run_up(words: Sequence[str]) -> list[str]:
    """A run-up from half the speed: in a second it is slow enough for orders."""
    slow = {DURATION: "1", "operating.speed_profile.first_factor": "0.5"}
    return with_values(words, {**slow, **FEW_SLICES})


def _least_flank(words: Sequence[str]) -> list[str]:
    independent = {
        **FEW_SLICES,
        "mesh.slice_coupling": "independent",
        "mesh.contact": "linear",
    }
    return with_values(words, independent)


LEAST = {
    "modify-flank": _least_flank,
    "generate": _least_set,
    "plan": _least_plan,
    "run-up": _least_run_up,
    "simulate": _least_record,
    "train": _least_training,
}


def least(words: Sequence[str]) -> list[str]:
    """Words of the least run that passes through the whole command."""
    words = LEAST.get(words[1], list)(words)
    for flag, values in FLAGS.get(words[1], {}).items():
        if flag in words:
            first = words.index(flag) + 1
            words[first : first + len(values_behind(words, flag))] = values
    return [*words, *ADDED.get(words[1], ())]
