"""The data card: README.md and croissant.json with facts from the files, and caveats."""

import html
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import yaml

from gensig.dataset.cards.class_figures import write_class_figures
from gensig.dataset.cards.croissant import croissant_text
from gensig.dataset.cards.facts import geometry_facts, value_range
from gensig.dataset.cards.origin import origin_of
from gensig.dataset.folder.layout import CARD, CROISSANT, SHARDS
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.splitting.dealing import GROUP_NAMES
from gensig.dataset.splitting.splits import SUBSETS
from gensig.dataset.storage.atomic import write_text

LOAD = """```python
import gensig

with gensig.open_dataset("PATH/TO/THIS/FOLDER") as data:
    labels = data.column("label")                    # (record,) index into data.class_names
    signal = data.signals(0)                         # (channel, sample) float32, m/s^2
    parts = data.split(data.protocols[0])            # the hardest protocol comes first
```
Without gensig: every shard is plain HDF5, see `docs/format.md` of gensig. \
Hugging Face `datasets` takes the folder
as it is, `load_dataset("PATH/TO/THIS/FOLDER")`; its one split, `train`, is all records, \
and `splits/` says which are
for training. `croissant.json` describes the files for machines.
"""

# Limits that the Hugging Face hub knows; above the last one a card says more.
SIZES = (
    (10**3, "n<1K"),
    (10**4, "1K<n<10K"),
    (10**5, "10K<n<100K"),
    (10**6, "100K<n<1M"),
    (10**7, "1M<n<10M"),
)
TAGS = (
    "vibration",
    "gear",
    "fault-diagnosis",
    "condition-monitoring",
    "time-series",
)

CAVEATS = """- `random_window_leaky` puts windows of one record on every side on purpose. \
Never report it
  without a clean split beside it.
- The speed and the signal power of a record are results: \
a fault may change them. Report results with and
  without RMS normalization.
- Columns of role label, fault or result (`docs/format.md`) \
and fault parameters in `params/` must not be
  inputs of a classifier.
- Records with status 'failed' are kept with their parameters; leave them out with `data.usable`.
- Only the band given as usable is meant to be used; above it the anti-alias filter acts.
"""


def write_card(out: Path, *, figures: bool = True) -> None:
    """Write `README.md`, its figures and `croissant.json` of a folder whose shards are done."""
    with open_dataset(out, allow_incomplete=True) as data:
        pictures = write_class_figures(data) if figures else {}
        write_text(out / CROISSANT, croissant_text(data, caveats_of(data)))
        write_text(out / CARD, card_text(data, pictures))


def card_text(data: Dataset, pictures: Mapping[str, str] | None = None) -> str:
    """Card as Markdown after Hugging Face front matter, with text from files escaped.

    Parameters
    ----------
    pictures : path in the folder by class name
    """
    version, origin = escape(data.manifest.generator_version), origin_of(data.manifest)
    sections = [
        front_matter(data),
        f"# {escape(data.folder.resolve().name)}",
        f"{origin.made} by gensig {version}.",
        table(("fact", "value"), set_facts(data)),
        "## Classes",
        table(("class", "records", "severity"), class_rows(data)),
        _gallery(pictures or {}),
        "## Splits",
        table(("protocol", *SUBSETS), _splits(data)),
        "## Load it",
        LOAD,
        "## Caveats",
        caveats_of(data),
        "## Licence",
        origin.license_text,
    ]
    return "\n\n".join(section.strip() for section in sections if section) + "\n"


def caveats_of(data: Dataset) -> str:
    """Caveats of a data set, by its origin, as a Markdown list."""
    return f"{origin_of(data.manifest).caveat}\n{CAVEATS}"


def _gallery(pictures: Mapping[str, str]) -> str:
    """One picture for each class, under a common title."""
    if not pictures:
        return ""
    title = (
        "The record of median severity of each class, noise included, on the same axes:"
    )
    shown = [f"![{escape(name)}]({path})" for name, path in pictures.items()]
    return "\n\n".join([title, *shown])


def front_matter(data: Dataset) -> str:
    """YAML for the Hugging Face hub and `load_dataset`: licence, tags, size, record files."""
    configs = [
        {
            "config_name": "default",
            "data_files": [{"split": "train", "path": f"{SHARDS}/*.h5"}],
        }
    ]
    return yaml_block({**hub_facts(data, data.n_records), "configs": configs})


def hub_facts(data: Dataset, n_rows: int) -> dict[str, object]:
    """Name, licence, task, tags and size of ``n_rows`` rows, by the keys of the hub."""
    sizes = [name for limit, name in SIZES if n_rows < limit]
    size, origin = (*sizes, "n>10M")[0], origin_of(data.manifest)
    return {
        "pretty_name": plain(data.folder.resolve().name),
        "license": origin.license_name,
        "task_categories": ["tabular-classification"],
        "tags": [
            *TAGS,
            *origin.tags,
            f"gensig-{plain(data.manifest.generator_version)}",
        ],
        "size_categories": [size],
    }


def yaml_block(content: Mapping[str, object]) -> str:
    """Front matter of a Markdown page."""
    text = yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True)
    return f"---\n{text}---"


def plain(value: object) -> str:
    """Printable text on one line."""
    return "".join(c if c.isprintable() else " " for c in str(value))


def escape(value: object) -> str:
    """Text for one Markdown table cell: no HTML, no markup, no line breaks, nothing invisible."""
    return re.sub(r"([\\`*_\[\]|#~!])", r"\\\1", html.escape(plain(value), quote=False))


def table(header: tuple[str, ...], rows: list[tuple[object, ...]]) -> str:
    """Markdown table with every cell escaped."""
    lines = [" | ".join(header), " | ".join("---" for _ in header)]
    lines += [" | ".join(escape(cell) for cell in row) for row in rows]
    return "\n".join(f"| {line} |" for line in lines)


def set_facts(data: Dataset) -> list[tuple[object, ...]]:
    """Rows of fact and value on all records of a data set."""
    units = data.attributes.get("channel_units", ["m/s^2"] * len(data.channel_names))
    pairs = zip(data.channel_names, units, strict=False)
    n_reference = int(np.count_nonzero(data.is_reference))
    records, n_failed = str(data.n_records), int(np.count_nonzero(~data.usable))
    if n_reference:
        n_examples = data.n_records - n_reference
        records += (
            f": {n_examples} examples, {n_reference} reference records in no split"
        )
    if n_failed:
        records += f", of which {n_failed} failed"
    seconds = data.n_samples / data.sampling_rate
    facts: dict[str, object] = {
        "records": records,
        "duration of a record": f"{seconds:g} s ({data.n_samples} samples)",
        "sampling rate": f"{data.sampling_rate:g} Hz",
        "channels": ", ".join(f"{name} ({unit})" for name, unit in pairs),
    }
    facts |= geometry_facts(data)
    for column, (_, plural) in GROUP_NAMES.items():
        facts[plural] = len(np.unique(data.column(column)))
    speed, torque = data.column("speed_rpm"), data.column("torque_nm")
    facts["speed of the driving shaft"] = value_range(speed, "r/min")
    facts[torque_words(data)] = value_range(torque, "N m")
    if "snr_db" in data.column_names:
        facts["signal-to-noise ratio"] = value_range(data.column("snr_db"), "dB")
    if data.sample_type == "int16":
        scaled = "int16; times acceleration_scale of record and channel it is m/s^2"
        facts["acceleration in the shards"] = scaled
    if data.compression != "none":
        facts["compression"] = data.compression
    if data.compression == "blosc2":
        facts["compression"] = "blosc2 (read with hdf5plugin)"
    facts |= {"seed": data.manifest.seed, "identity": data.manifest.identity}
    return list(facts.items())


def class_rows(data: Dataset) -> list[tuple[object, ...]]:
    """Rows of class, number of records and range of severity, without reference records."""
    is_example = ~data.is_reference
    names = data.column("label_name")[is_example]
    severity = data.column("severity")[is_example]
    order = [name for name in data.class_names if (names == name).any()]
    order += sorted(set(names.tolist()) - set(order))
    return [
        (name, int((names == name).sum()), value_range(severity[names == name], ""))
        for name in order
    ]


def _splits(data: Dataset) -> list[tuple[object, ...]]:
    rows: list[tuple[object, ...]] = []
    for protocol in data.protocols:
        sizes = [
            sum(stop - start for _, start, stop in part)
            for part in data.split(protocol).values()
        ]
        rows.append((protocol, *(f"{size:g} records" for size in sizes)))
    return rows


def torque_words(data: Dataset) -> str:
    """Name of the quantity in `torque_nm`, which for a drive line is the torque of its load."""
    return f"torque of the {plain(data.attributes.get('torque_of', 'driving shaft'))}"
