"""gensig: labelled gear-fault vibration data sets from physics.

>>> import gensig
>>> data = gensig.open_dataset("runs/quickstart")            # doctest: +SKIP
>>> stream = gensig.stream("experiment=quickstart")             # doctest: +SKIP
>>> system = gensig.load_system("gear=xiamen_23_84", "operating.torque_nm=40")
>>> float(system.pair.transverse_contact_ratio)              # doctest: +ELLIPSIS
1.7117...

Importing the package is light: physics, HDF5 and Hydra are imported by the functions that need
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gensig.version import __version__

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset
    from gensig.faults.base import Fault
    from gensig.implants.implanting import Given

    # named by diagnose, which imports nothing else of the physics
    from gensig.production.fault_pairs import FaultPairs as FaultPairs
    from gensig.production.fault_pairs import PairCell as PairCell
    from gensig.production.streaming import RecordStream
    from gensig.systems.base import Machine

__all__ = [
    "__version__",
    "fault_pairs",
    "generate",
    "implant",
    "load_faults",
    "load_system",
    "open_dataset",
    "stream",
]


def open_dataset(
    path: str | Path, *, allow_incomplete: bool = False, check: str = "quick"
) -> Dataset:
    """Open the folder of a data set for reading; nothing in it is changed.

    Parameters
    ----------
    path : the folder
    allow_incomplete : opens an interrupted run too; records of missing shards are not ``usable``
    check : ``quick`` compares names, sizes, the manifest and the plan on opening, and looks at
            each shard before its first record is read; ``full`` reads and compares every byte
            first, as ``gensig verify`` does. ``gensig.dataset.reader`` says which damage is
            noticed when

    Returns
    -------
    Dataset    columns of all records by ``column``, accelerations by ``signals``, records that meet
               conditions by ``where``, subsets by ``split``

    Raises
    ------
    gensig.errors.DatasetError    for a folder that is no data set, is damaged as far as that is
            checked, or is incomplete
    """
    from gensig.dataset import reader

    return reader.open_dataset(path, allow_incomplete=allow_incomplete, check=check)


def load_system(*overrides: str, config_dir: str | Path | None = None) -> Machine:
    """The healthy machine that overrides describe, as the commands would build it.

    For its faults see `load_faults`.

    Parameters
    ----------
    overrides : ``group=option`` and ``key=value``, as for ``gensig simulate``
    config_dir : folder with options of your own; None finds them in ``./configs``

    Raises
    ------
    gensig.errors.GensigError    for anything that cannot be used
    """
    from gensig.plan.request import read_request
    from gensig.record.machines import read_machine

    return read_machine(read_request(overrides, config_dir=config_dir).config)


def load_faults(
    *overrides: str, config_dir: str | Path | None = None
) -> tuple[Fault, ...]:
    """The faults that overrides describe, for the methods of a machine; none for ``fault=healthy``.

    >>> import gensig
    >>> faults = gensig.load_faults("fault=crack", "fault.crack_depth_mm=1.5")
    >>> curves = gensig.load_system().stiffness_curves(faults)
    >>> bool((curves.faulty_pair_stiffness <= curves.single_pair_stiffness).all())
    True

    Parameters
    ----------
    overrides : ``fault=option`` and ``fault.key=value``, as for ``gensig simulate``
    config_dir : folder with options of your own; None finds them in ``./configs``

    Raises
    ------
    gensig.errors.GensigError    for anything that cannot be used
    """
    from gensig.faults.registry import read_faults
    from gensig.plan.request import read_request

    return read_faults(read_request(overrides, config_dir=config_dir).config["fault"])


def generate(
    *overrides: str,
    out: str | Path,
    config_dir: str | Path | None = None,
    workers: int | None = None,
    progress: bool = True,
    reuse: bool = False,
) -> Dataset:
    """Make a data set and open it.

    Parameters
    ----------
    overrides : ``group=option`` and ``key=value``, as for ``gensig generate``
    out : folder that does not exist or is empty
    config_dir : folder with options of your own; None finds them in ``./configs``
    workers : processes of this machine; None takes the executor of the overrides, by default a
            process for each core
    progress : shows the records that are made: a bar on a terminal and in notebooks, elsewhere a
            line every few seconds on stderr
    reuse : opens ``out`` where it is this data set already, and finishes it where it is incomplete

    Raises
    ------
    gensig.errors.GensigError    for anything that cannot be used, for a shard that fails, and with
            ``reuse`` for a folder that is another data set
    """
    from gensig.production.making import make_folder

    make_folder(
        overrides,
        Path(out),
        config_dir=config_dir,
        workers=workers,
        progress=progress,
        reuse=reuse,
    )
    return open_dataset(out)


def stream(
    *overrides: str, epoch: int = 0, config_dir: str | Path | None = None
) -> RecordStream:
    """The records that ``generate`` would write, simulated in a loop and never stored.

    Parameters
    ----------
    overrides : as for ``gensig generate``; ``out`` and ``executor`` change nothing
    epoch : 0 gives the bits of ``generate``; any other number as many records with new draws,
            units included
    config_dir : folder with options of your own; None finds them in ``./configs``

    Raises
    ------
    gensig.errors.GensigError    for anything that cannot be used
    """
    from gensig.errors import ConfigError
    from gensig.options.compose import sweep
    from gensig.plan.request import read_request
    from gensig.production.streaming import open_stream

    if len(sweep(overrides)) > 1:
        raise ConfigError(
            "a stream is one data set: give one value a key, and make a stream for each"
        )
    return open_stream(
        read_request(overrides, config_dir=config_dir).config, epoch=epoch
    )


def fault_pairs(
    *overrides: str,
    speeds_rpm: Sequence[float] | None = None,
    torques_nm: Sequence[float] | None = None,
    n_units: int = 8,
    fixed_noise: bool = False,
    epoch: int = 0,
    config_dir: str | Path | None = None,
) -> FaultPairs:
    """The selected machine with and without its fault over a map of speeds and torques.

    Parameters
    ----------
    overrides : ``group=option`` and ``key=value``, with a fault
    speeds_rpm, torques_nm : axes of the map; None takes shares of the set-point
    n_units : machines a point, each with manufacturing errors of its own
    fixed_noise : True takes the noise of the set-point everywhere
    epoch : draws other machines
    config_dir : folder with options of your own; None finds them in ``./configs``

    Raises
    ------
    gensig.errors.GensigError    for anything that cannot be used
    """
    from gensig.plan.request import read_request
    from gensig.production.fault_pairs import make_pairs

    config = read_request(overrides, config_dir=config_dir).config
    return make_pairs(
        config,
        speeds_rpm=speeds_rpm,
        torques_nm=torques_nm,
        n_units=n_units,
        fixed_noise=fixed_noise,
        epoch=epoch,
    )


def implant(
    data: str | Path,
    recordings: Sequence[Given],
    *,
    out: str | Path,
    teeth: Sequence[int],
    speed_rpm: float | Sequence[float],
    gain_db: tuple[float, float] = (-10.0, 10.0),
    path: str = "twin",
    residual: str = "physics",
    n_records: int = 600,
    duration_s: float | None = None,
    held_out: float = 0.25,
    plain_healthy: float = 0.5,
    seed: int = 0,
) -> Dataset:
    """Make a data set of healthy recordings plus residuals of simulated faults, and open it.

    `gensig.implants.implanting.implant_records` returns them in memory.

    Parameters
    ----------
    data : folder of a data set without noise and with healthy twins (``sensing.snr_db=null
           dataset.store_healthy_twin=true``)
    recordings : healthy recordings of one machine: files that tell their rate in m/s2, or
                 `gensig.signals.recording.Recording`
    out : folder that does not exist or is empty
    teeth : driving and driven gear of each stage in turn
    speed_rpm : r/min of the driving shaft, within 3 %: one, or one a recording
    gain_db : dB, ends of the uniform law of a residual's RMS over its carrier's
    path : ``twin`` fits the response from the simulated sensor as ``gensig twin``, ``none`` does
           not
    residual : ``physics``, or a control: ``noise_bursts``, ``shuffled_phases``, ``none``
    n_records : of the set
    duration_s : of a record; None follows the length of the recordings
    held_out : share of the blocks of each recording, its last ones, that carry nothing
    plain_healthy : share of the healthy records that carry nothing
    seed : every drawn number follows from it

    Returns
    -------
    Dataset    of the classes healthy, one_tooth and many_teeth, as far as ``data`` has them

    Raises
    ------
    gensig.errors.GensigError    for anything that cannot be used
    """
    from gensig.errors import SimulationError
    from gensig.implants.implant_folder import HERE, begin_implants
    from gensig.implants.implant_sources import ImplantSources, open_implanter
    from gensig.implants.implanting import speeds_of
    from gensig.implants.options import ImplantOptions
    from gensig.production.folder import run_folder

    options = ImplantOptions(
        gain_db=gain_db,
        path=path,
        residual=residual,
        n_records=n_records,
        duration=duration_s,
        held_out=held_out,
        plain_healthy=plain_healthy,
        seed=seed,
    )
    sources = ImplantSources(
        data=Path(data),
        healthy=tuple(recordings),
        teeth=tuple(teeth),
        speed_rpm=tuple(speeds_of(speed_rpm)),
        options=options,
    )
    implanter, folder = open_implanter(sources), Path(out)
    with implanter.pairs.data:
        maker = begin_implants(folder, implanter, sources)
        _, problems = run_folder(
            folder, executor=HERE, on_shard=lambda _: None, maker=maker
        )
    if problems:
        raise SimulationError(f"{out} is incomplete: {problems[0]}")
    return open_dataset(out)
