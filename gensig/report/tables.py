"""Sections of text and tables: contents, splits, provenance, loading."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gensig.dataset.cards.card import caveats_of
from gensig.dataset.cards.facts import (
    channel_units,
    class_examples,
    geometry_facts,
    rounded,
    running_facts,
    value_range,
)
from gensig.dataset.folder.layout import CONFIG, CONFIG_BYTES_LIMIT, OVERRIDES
from gensig.dataset.reader import Dataset
from gensig.dataset.splitting.dealing import GROUP_NAMES
from gensig.dataset.splitting.protocols import PROTOCOLS
from gensig.dataset.storage.atomic import read_text
from gensig.report.realism import Comparison, number_text, shown_range
from gensig.text.escaping import plain
from gensig.text.page import Charts, Section, Table

MANY_SHARDS = 200
IN_WORDS = {
    "n_teeth_pinion": "teeth of the pinion",
    "n_teeth_wheel": "teeth of the wheel",
    "normal_module_mm": "normal module, mm",
    "pressure_angle_deg": "pressure angle, degrees",
    "helix_angle_deg": "helix angle, degrees",
    "face_width_pinion_mm": "face width of the pinion, mm",
    "face_width_wheel_mm": "face width of the wheel, mm",
    "center_distance_mm": "centre distance, mm",
    "transverse_contact_ratio": "transverse contact ratio",
    "overlap_ratio": "overlap ratio",
    "usable_band_hz": "usable band, Hz",
}


def contents(data: Dataset) -> list[Section]:
    """Facts of the data set, and its classes."""
    n_failed = int(np.count_nonzero(~data.usable))
    records, n_reference = f"{data.n_records}", int(np.count_nonzero(data.is_reference))
    if n_reference:
        records += f", of which {n_reference} are reference records in no split"
    if n_failed:
        records += f", of which {n_failed} failed and are left out here"
    duration = data.n_samples / data.sampling_rate
    sampling = f"{data.n_samples} samples at {data.sampling_rate:g} Hz"
    units = [
        f"{plain(name)} ({plain(unit)})" for name, unit in channel_units(data).items()
    ]
    further = [name for name in data.signal_names if name != "acceleration"]
    rows = [
        ("records", records),
        ("a record", f"{duration:g} s, {sampling}"),
        ("channels", ", ".join(units)),
        ("further signals", ", ".join(further) or "none"),
    ]
    rows += [
        (IN_WORDS.get(name, name), _shown(value))
        for name, value in geometry_facts(data).items()
    ]
    rows += [(name, f"{value}") for name, value in running_facts(data).items()]
    if "life_id" in data.column_names:
        n_lives = len(np.unique(data.column("life_id")))
        rows.append(("lives", f"{n_lives}, to failure or to the horizon"))
    facts = Table(head=("fact", "value"), rows=rows)
    return [
        Section(title="What is in it", table=facts, folded=True),
        Section(title="Classes", table=_classes(data), folded=True),
    ]


def _classes(data: Dataset) -> Table:
    unit, severities = data.column("unit_id"), data.column("severity")
    rows = []
    for name, mine in class_examples(data).items():
        severity, median = severities[mine], "none"
        if np.isfinite(severity).any():
            median = f"{np.nanmedian(severity):.3g}"
        n_units = len(np.unique(unit[mine]))
        spread = value_range(severity, "")
        rows.append((plain(name), mine.sum(), n_units, spread, median))
    return Table(
        head=("class", "records", "machines", "severity", "its median"), rows=rows
    )


def splits(data: Dataset) -> Section:
    """Records and units of every subset of every protocol."""
    unit = data.column("unit_id")
    rows: list[tuple[str, ...]] = []
    leaky: list[int] = []
    for protocol in data.protocols:
        parts = data.split(protocol)
        units = {
            name: set(unit[[row[0] for row in part]].tolist())
            for name, part in parts.items()
        }
        cells = [
            f"{sum(stop - start for _, start, stop in part):.5g} ({len(units[name])})"
            for name, part in parts.items()
        ]
        apart = []
        if protocol in PROTOCOLS:
            apart = [GROUP_NAMES[name][1] for name in PROTOCOLS[protocol].apart]
        if not apart:
            leaky.append(len(rows))
        shared = len(units["train"] & units["test"])
        kept = ", ".join(apart) or "nothing: leaks on purpose"
        rows.append((plain(protocol), *cells, f"{shared}", kept))
    head = (
        "protocol",
        "train",
        "validation",
        "test",
        "machines on both sides",
        "keeps apart",
    )
    text = [
        "Records of each subset, and in brackets the machines that they are from.",
        "A score is only worth what its protocol keeps apart.",
    ]
    left_out = [(name, plain(reason)) for name, reason in data.left_out.items()]
    if left_out:
        text.append("Below: protocols that this set cannot have, and why.")
    table = None
    if rows:
        table = Table(head=head, rows=rows, quiet=leaky)
    return Section(title="Splits", text=text, table=table, notes=left_out, folded=True)


def comparisons(compared: Sequence[Comparison], units: Sequence[str]) -> Section:
    """Values of the set beside measured ranges, or the reason why there are none."""
    text = [
        "Central 90 % of this set's values beside ranges of published recordings of a "
        "two-stage parallel spur gearbox (5 kHz, one set of gears a class), which is another "
        "machine: a miss says that they differ, not which is wrong. RMS and kurtosis are "
        'those of the band up to 2.5 kHz. Ranges "elsewhere" were published for all '
        "conditions but the slow and light ones; here they stand beside all records."
    ]
    if not compared:
        reason = "it has none of their quantities"
        if "m/s^2" not in units:
            reason = "no channel is an acceleration in m/s^2"
        text.append(f"This set cannot be put beside them: {reason}.")
        return Section(title="Beside measurements", text=text)
    rows = [
        (
            item.id,
            item.at,
            shown_range(item),
            number_text(item.median),
            f"{number_text(item.p5)} to {number_text(item.p95)}",
            item.n,
            item.verdict,
        )
        for item in compared
    ]
    head = (
        "quantity",
        "at",
        "measured",
        "median here",
        "5 to 95 % here",
        "values",
        "verdict",
    )
    return Section(
        title="Beside measurements",
        text=text,
        charts=Charts(
            name="beside",
            label="Nothing to choose",
            plots=[("beside", "Measured ranges and this set")],
        ),
        table=Table(head=head, rows=rows, folded="The same as a table"),
    )


def provenance(data: Dataset) -> list[Section]:
    """Version, environment, seed, identity, configuration and checksums of the data set."""
    manifest = data.manifest
    rows = [
        ("made by", f"gensig {plain(manifest.generator_version)}"),
        ("format version", f"{manifest.schema_version}"),
        ("seed", f"{manifest.seed}"),
        (
            "identity (sha256 of configuration, schema and version)",
            plain(manifest.identity),
        ),
    ]
    rows += [
        (plain(name).replace("_", " "), plain(value))
        for name, value in manifest.environment.items()
        if value
    ]
    files = [
        (f"shards/{plain(shard.name)}", f"{shard.rows}", shard.sha256)
        for shard in manifest.shards[:MANY_SHARDS]
    ]
    files += [(plain(name), "", digest) for name, digest in manifest.files.items()]
    text = ["As the manifest has them; gensig verify compares them with the files."]
    if len(manifest.shards) > MANY_SHARDS:
        text.append(f"The first {MANY_SHARDS} of {len(manifest.shards)} shards.")
    return [
        Section(
            title="Where it is from",
            table=Table(head=("fact", "value"), rows=rows),
            folded=True,
        ),
        Section(
            title="Overrides as typed", code=_file(data.folder / OVERRIDES), folded=True
        ),
        Section(title="Configuration", code=_file(data.folder / CONFIG), folded=True),
        Section(
            title="Files",
            text=text,
            table=Table(head=("file", "records", "sha256"), rows=files),
            folded=True,
        ),
    ]


def loading(data: Dataset) -> list[Section]:
    """Code that reads this set, and its caveats."""
    faulty = [name for name in data.class_names if name != "healthy"]
    name = [*faulty, *data.class_names][0]
    units = ", ".join(dict.fromkeys(channel_units(data).values()))
    protocols = data.protocols
    code = [
        "import gensig",
        "",
        'with gensig.open_dataset("PATH/TO/THIS/FOLDER") as data:',
        "    print(data.class_names, data.channel_names, data.sampling_rate)",
        '    labels = data.column("label")  # (record,) index into data.class_names',
        f"    signal = data.signals(0)  # (channel, sample) float32: {units}",
        f"    mine = data.where(fault={name!r}, status='ok')  # by class, or by any column",
    ]
    if protocols:
        code.append(
            f"    train = data.split({protocols[0]!r})['train']"
            "  # [(record, start_fraction, stop_fraction), ...]"
        )
    text = ["Every shard is plain HDF5 too: h5py, MATLAB and Octave read it."]
    caveats = [("", caveat.replace("`", "")) for caveat in caveats_of(data)]
    return [
        Section(title="Load it", text=text, code="\n".join(code)),
        Section(title="What to mind", notes=caveats),
    ]


def _file(path: Path) -> str:
    return "".join(
        c if c.isprintable() or c == "\n" else " "
        for c in read_text(path, limit=CONFIG_BYTES_LIMIT)
    )


def _shown(value: object) -> str:
    if isinstance(value, (list, tuple, np.ndarray)):
        return " to ".join(map(_compact, value))
    return plain(rounded(value))


def _compact(value: object) -> str:
    if isinstance(value, (int, float)):
        return f"{value:g}"
    return plain(value)
