"""The card of a data set in the form of Hugging Face: README.md with its front matter."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from gensig.dataset.cards.card import hub_facts, whole_card, yaml_block
from gensig.dataset.cards.origin import origin_of
from gensig.dataset.exports.export_tables import unit_of
from gensig.dataset.exports.hub_features import Feature, card_features
from gensig.dataset.exports.split_columns import is_clean
from gensig.dataset.reader import Dataset
from gensig.dataset.schema import PARAMS, known_column
from gensig.dataset.splitting.protocols import PROTOCOLS
from gensig.dataset.splitting.splits import SUBSETS
from gensig.text.escaping import plain
from gensig.text.page import Section, Table

DATA = "data"  # folder of the Parquet files
OF_SHARDS = ("acceleration in the shards", "compression")  # facts that an export lacks

LOAD = """from datasets import load_dataset

records = load_dataset("PATH/TO/THIS/FOLDER", "{protocol}").with_format("numpy")
record = records["train"][0]
signal = record["acceleration"]                          # (channel, sample) float32
names = records["train"].features["label"].names         # class of label 0, 1, ..."""
ONE_PROTOCOL = (
    "`load_dataset` needs datasets 4.0 or later. The Parquet files need no Hugging Face library. "
    "Load the files of one protocol only: together with those of another, training has the units "
    "of its test."
)
LEAKY = (
    "**`{protocol}` leaks.** Windows of the same record are in every subset, on purpose. A score "
    "on it says nothing of a machine that was not trained on. Never report it without a clean "
    "split beside it."
)
UNCHECKED = (
    "**`{protocol}` is unchecked.** The version of gensig that wrote this folder does not know "
    "which machines it keeps apart."
)
STRETCHES = (
    "Rows of `{protocol}` are stretches of records: the signals from `start_sample` to before "
    "`stop_sample`, in samples of the record. No sample is in two rows."
)
CAVEATS = (
    "Inputs of a classifier are signals, and at most columns of role condition. Columns of role "
    "label, fault or result and those that begin with `params/` must not be inputs.",
    "The speed and the signal power of a record are results: a fault may change them. Report "
    "results with and without RMS normalization.",
    "A clean split compares scores on machines never seen. Tune on `validation`; use `test` once.",
)

OTHER_COLUMNS = {
    "start_sample": "first sample of the row in its record",
    "stop_sample": "sample of the record before which the row ends",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SubsetFiles:
    """Size of one subset on disk.

    Parameters
    ----------
    n_rows : int      rows
    n_bytes : int     bytes in memory
    n_stored : int    bytes of its files
    """

    n_rows: int
    n_bytes: int
    n_stored: int


@dataclass(frozen=True, slots=True, kw_only=True)
class HubConfig:
    """One configuration: the files of one protocol.

    Parameters
    ----------
    protocol : str       its name
    features : dict      feature of each column
    subsets : dict       size of each subset that has rows, in the order of `SUBSETS`
    n_left_out : int     records of the data set without a row
    cut : bool           whether rows are stretches of records
    """

    protocol: str
    features: Mapping[str, Feature]
    subsets: Mapping[str, SubsetFiles]
    n_left_out: int
    cut: bool

    @property
    def n_rows(self) -> int:
        """Rows of all subsets."""
        return sum(files.n_rows for files in self.subsets.values())


def hub_card(data: Dataset, configs: Sequence[HubConfig]) -> str:
    """Card as Markdown after front matter, with text from files escaped."""
    header = ("configuration", "apart in its subsets", *SUBSETS, "records left out")
    splits = Table(head=header, rows=[_split_row(config) for config in configs])
    columns = Table(
        head=("column", "unit", "role", "meaning"), rows=_column_rows(data, configs)
    )
    load = LOAD.format(protocol=configs[0].protocol)
    middle = [
        Section(title="Splits", text=[_split_words(data)], table=splits),
        Section(title="", text=[line for one in configs for line in _warnings(one)]),
        Section(title="Load it", code=load),
        Section(title="", text=[ONE_PROTOCOL]),
        Section(title="Columns", table=columns),
    ]
    return whole_card(
        data,
        _front_matter(data, configs),
        middle,
        (*origin_of(data.manifest).caveats, *CAVEATS),
        made=", with its splits",
        lacking=OF_SHARDS,
    )


def _front_matter(data: Dataset, configs: Sequence[HubConfig]) -> str:
    """YAML: files, features and sizes of each configuration; the first is the default."""
    largest = max(config.n_rows for config in configs)
    files = [_files_entry(config) for config in configs]
    files[0]["default"] = True
    infos = [_info_entry(config) for config in configs]
    facts = hub_facts(data, largest)
    return yaml_block({**facts, "configs": files, "dataset_info": infos})


def _files_entry(config: HubConfig) -> dict[str, object]:
    folder = f"{DATA}/{config.protocol}"
    files = [
        {"split": subset, "path": f"{folder}/{subset}-*.parquet"}
        for subset in config.subsets
    ]
    return {"config_name": config.protocol, "data_files": files}


def _info_entry(config: HubConfig) -> dict[str, object]:
    sizes = config.subsets.values()
    splits = [
        {"name": subset, "num_bytes": files.n_bytes, "num_examples": files.n_rows}
        for subset, files in config.subsets.items()
    ]
    return {
        "config_name": config.protocol,
        "features": card_features(dict(config.features)),
        "splits": splits,
        "download_size": sum(files.n_stored for files in sizes),
        "dataset_size": sum(files.n_bytes for files in sizes),
    }


def _split_words(data: Dataset) -> str:
    """Paragraph on configurations and on the records that none of them has."""
    words = (
        "A configuration is one protocol with files of its own, so a record may be in several. "
        "A machine is one set of gears in one gearbox. No value of the columns named "
        "below is in two subsets."
    )
    n_failed = int((~data.usable).sum())
    if n_failed:
        words += f" Failed records are left out everywhere: {n_failed}."
    if data.is_reference.any():
        words += " Reference records are in no subset and are left out."
    return words


def _split_row(config: HubConfig) -> tuple[object, ...]:
    apart = "nothing"
    if is_clean(config.protocol):
        names = ("record_id", *PROTOCOLS[config.protocol].apart)
        apart = ", ".join(names)
    elif config.protocol not in PROTOCOLS:
        apart = "unknown"
    rows = []
    for subset in SUBSETS:
        files = config.subsets.get(subset)
        rows.append(files.n_rows if files else 0)
    return (config.protocol, apart, *rows, config.n_left_out)


def _warnings(config: HubConfig) -> Iterator[str]:
    """Paragraphs on a protocol that leaks, is unknown or cuts records."""
    if config.protocol not in PROTOCOLS:
        yield UNCHECKED.format(protocol=config.protocol)
    elif not is_clean(config.protocol):
        yield LEAKY.format(protocol=config.protocol)
    if config.cut:
        yield STRETCHES.format(protocol=config.protocol)


def _column_rows(
    data: Dataset, configs: Sequence[HubConfig]
) -> list[tuple[object, ...]]:
    """Name, unit, role and meaning of every column of any configuration."""
    names: dict[str, None] = {}
    for config in configs:
        names |= dict.fromkeys(config.features)
    rows: list[tuple[object, ...]] = []
    for name in names:
        column = known_column(name)
        if column:
            unit = unit_of(data, name)
            rows.append((name, unit, column.role, column.description))
        elif name.startswith(f"{PARAMS}/"):
            rows.append((name, "in the name", "", "drawn or swept value"))
        else:
            rows.append((plain(name), "", "", OTHER_COLUMNS.get(name, "")))
    return rows
