"""A sampling of `diagnose detectability` in words, and as content of a JSON file."""

from __future__ import annotations

from typing import Any

from diagnose.detectability.sampling import (
    FOUND_KNOWN,
    FOUND_SEEN,
    Sample,
    Sampling,
    found_from,
)
from diagnose.detectability.summary import short, two_digits
from gensig.text.amounts import finite

WIDTH = 16  # of a column


def sampling_lines(sampling: Sampling) -> list[str]:
    """Two tables of d' over size and ratio, and one line a ratio with the sizes that are found."""
    n_units = sampling.n_units
    seen = f"d' by indicators on {n_units} machines that did not choose them (AUROC)"
    return [
        f"{sampling.speed_rpm:g} r/min, {sampling.torque_nm:g} N m, records of "
        f"{sampling.duration:g} s; {seen}",
        *_table(sampling, _seen_text),
        f"d' of a filter that knows what the fault adds, median of {n_units} machines",
        *_table(sampling, lambda sample: short(sample.known)),
        *found_lines(sampling),
    ]


def found_lines(sampling: Sampling) -> list[str]:
    """One line a ratio: the sizes from which on the fault is found by both observers."""
    seen = found_from(sampling.values("on_others"), FOUND_SEEN)
    known = found_from(sampling.values("known"), FOUND_KNOWN)
    kind = str(sampling.fault["kind"]).replace("_", " ")
    return [
        f"at {ratio:g} dB the {kind} is found {_from_text(sampling, by_indicators)} by indicators "
        f"(d' at least {FOUND_SEEN:g}) and {_from_text(sampling, by_filter)} by the filter "
        f"(d' at least {FOUND_KNOWN:g})"
        for ratio, by_indicators, by_filter in zip(
            sampling.axes.snrs_db, seen, known, strict=True
        )
    ]


def size_text(sampling: Sampling, number: int) -> str:
    """A sampled size with its unit, such as '1.5 mm'."""
    unit = sampling.axes.size_key.rpartition("_")[2]
    return f"{sampling.axes.sizes[number]:g} {unit}"


def sampling_content(sampling: Sampling) -> dict[str, Any]:
    """Content of ``diagnose detectability --json`` of a sampling.

    ``samples`` has a row for each size and ratio.
    """
    seen = found_from(sampling.values("on_others"), FOUND_SEEN)
    known = found_from(sampling.values("known"), FOUND_KNOWN)
    return {
        "fault": sampling.fault,
        "size_key": sampling.axes.size_key,
        "speed_rpm": sampling.speed_rpm,
        "torque_nm": sampling.torque_nm,
        "n_units": sampling.n_units,
        "duration_s": sampling.duration,
        "summary": found_lines(sampling),
        "found": [
            {
                "snr_db": ratio,
                "by_indicators_from": _size(sampling, seen[number]),
                "by_filter_from": _size(sampling, known[number]),
            }
            for number, ratio in enumerate(sampling.axes.snrs_db)
        ],
        "samples": [
            _row(sample, size=size, snr_db=ratio)
            for size, row in zip(sampling.axes.sizes, sampling.samples, strict=True)
            for ratio, sample in zip(sampling.axes.snrs_db, row, strict=True)
        ],
    }


def _row(sample: Sample, *, size: float, snr_db: float) -> dict[str, Any]:
    channel, bandwidth, indicator = sample.test
    return {
        "size": size,
        "snr_db": snr_db,
        "d_prime_known": finite(sample.known),
        "d_prime_seen": finite(sample.seen),
        "d_prime_on_others": finite(sample.on_others),
        "standard_error_on_others": finite(sample.standard_error),
        "auroc_on_others": finite(sample.auroc),
        "channel": channel,
        "bandwidth_hz": bandwidth,
        "indicator": indicator,
        "n_failed": sample.n_failed,
    }


def _seen_text(sample: Sample) -> str:
    return f"{two_digits(sample.on_others)} ({sample.auroc:.2f})"


def _table(sampling: Sampling, text: Any) -> list[str]:
    head = [
        sampling.axes.size_key,
        *(f"{ratio:g} dB" for ratio in sampling.axes.snrs_db),
    ]
    rows = [
        [f"{size:g}", *map(text, row)]
        for size, row in zip(sampling.axes.sizes, sampling.samples, strict=True)
    ]
    first = max(WIDTH, len(head[0]) + 2)
    return [
        f"{name:<{first}}{''.join(f'{cell:>{WIDTH}}' for cell in cells)}"
        for name, *cells in (head, *rows)
    ]


def _from_text(sampling: Sampling, number: int | None) -> str:
    if number is None:
        return f"at none of the sizes up to {size_text(sampling, -1)}"
    if number == 0:
        return f"already at {size_text(sampling, 0)}, the least sampled,"
    return f"from {size_text(sampling, number)} on"


def _size(sampling: Sampling, number: int | None) -> float | None:
    return None if number is None else sampling.axes.sizes[number]
