"""The data card: README.md and croissant.json with facts from the files, and caveats."""

from collections.abc import Container, Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml

from gensig.dataset.cards.class_figures import write_class_figures
from gensig.dataset.cards.croissant import croissant_text
from gensig.dataset.cards.facts import (
    channel_units,
    class_examples,
    geometry_facts,
    running_facts,
    value_range,
)
from gensig.dataset.cards.origin import origin_of
from gensig.dataset.folder.layout import CARD, CROISSANT, SHARDS
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.splitting.splits import SUBSETS
from gensig.dataset.storage.atomic import write_text
from gensig.text.escaping import plain
from gensig.text.markdown import escape, page_text
from gensig.text.page import Section, Table

LOAD = """import gensig

with gensig.open_dataset("PATH/TO/THIS/FOLDER") as data:
    labels = data.column("label")                    # (record,) index into data.class_names
    signal = data.signals(0)                         # (channel, sample) float32, m/s^2
    parts = data.split(data.protocols[0])            # the hardest protocol comes first"""
OTHER_READERS = (
    "Without gensig: every shard is plain HDF5, see `docs/format.md` of gensig. Hugging Face "
    '`datasets` takes the folder as it is, `load_dataset("PATH/TO/THIS/FOLDER")`; its one split, '
    "`train`, is all records, and `splits/` says which are for training. `croissant.json` "
    "describes the files for machines."
)
GALLERY = (
    "The record of median severity of each class, noise included, on the same axes:"
)

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

CAVEATS = (
    "`random_window_leaky` puts windows of one record on every side on purpose. Never report it "
    "without a clean split beside it.",
    "The speed and the signal power of a record are results: a fault may change them. Report "
    "results with and without RMS normalization.",
    "Columns of role label, fault or result (`docs/format.md`) and fault parameters in `params/` "
    "must not be inputs of a classifier.",
    "Records with status 'failed' are kept with their parameters; leave them out with "
    "`data.usable`.",
    "Only the band given as usable is meant to be used; above it the anti-alias filter acts.",
)


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
    records = []
    if pictures:
        figures = [(path, name) for name, path in pictures.items()]
        records.append(Section(title="", text=[GALLERY], figures=figures))
    table = Table(head=("protocol", *SUBSETS), rows=_splits(data))
    middle = [
        *records,
        Section(title="Splits", table=table),
        Section(title="Load it", code=LOAD),
        Section(title="", text=[OTHER_READERS]),
    ]
    return whole_card(data, front_matter(data), middle, caveats_of(data))


def whole_card(
    data: Dataset,
    matter: str,
    middle: Sequence[Section],
    caveats: Sequence[str],
    *,
    made: str = "",
    lacking: Container[str] = (),
) -> str:
    """A card: facts and classes, what is its own, caveats and licence.

    Parameters
    ----------
    matter : front matter
    made : words behind the version
    lacking : facts that are not those of these files
    """
    version, origin = escape(data.manifest.generator_version), origin_of(data.manifest)
    facts = [row for row in set_facts(data) if row[0] not in lacking]
    classes = Table(head=("class", "records", "severity"), rows=class_rows(data))
    sections = [
        Section(title="", table=Table(head=("fact", "value"), rows=facts)),
        Section(title="Classes", table=classes),
        *middle,
        Section(title="Caveats", notes=[("", caveat) for caveat in caveats]),
        Section(title="Licence", text=[origin.license_text]),
    ]
    lead = [f"{origin.made} by gensig {version}{made}."]
    text = page_text(plain(data.folder.resolve().name), lead, sections)
    return f"{matter}\n\n{text}"


def caveats_of(data: Dataset) -> list[str]:
    """Caveats of a data set, by its origin, as Markdown."""
    return [*origin_of(data.manifest).caveats, *CAVEATS]


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


def set_facts(data: Dataset) -> list[tuple[object, ...]]:
    """Rows of fact and value on all records of a data set."""
    units = channel_units(data).items()
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
        "channels": ", ".join(f"{name} ({unit})" for name, unit in units),
    }
    facts |= geometry_facts(data) | running_facts(data)
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
    severity = data.column("severity")
    return [
        (name, int(mine.sum()), value_range(severity[mine], ""))
        for name, mine in class_examples(data).items()
        if mine.any()
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
