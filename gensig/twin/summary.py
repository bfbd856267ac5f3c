"""Report of a fitted machine: fitted values, assumptions, and the held-out check."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gensig.text.markdown import page_text
from gensig.text.page import Section, Table
from gensig.twin.check import EXPECTED, INDICATOR_UNITS, INDICATORS, N_RECORDS, Check
from gensig.twin.fitting import Fit

UNKNOWN = (
    "How a fault of this machine sounds: faults follow from the model and the geometry above, not "
    "from the recording. The load, the stiffness of teeth and bearings, backlash, and tip relief: "
    "they are given or assumed, and what they do wrong the fitted path and grade make up for at "
    "this speed and load only. The path begins at one bearing, along the line of action; what "
    "reaches the sensors by other ways is in it. Below half the mesh frequency everything that the "
    "model lacks is counted as noise. The grade is the one whose sidebands are as strong: "
    "eccentricity, couplings and load that varies make it look coarser."
)
VERDICTS = {True: "agrees", False: "NO"}


def fitted_rows(fitted: Fit, n_driving: int) -> list[tuple[str, str]]:
    """Fitted values by name."""
    motion, grade = fitted.motion, fitted.grade
    share = f"{100 * fitted.pitch_error_scatter:.4f} %"
    grade_text = f"pitch errors of that grade make {share} by themselves"
    drift = (
        "none written: one harmonic alone is heard, which does not tell it from noise"
    )
    if motion.scatter is not None:
        seen = f"{100 * motion.scatter:.4f} % seen"
        time = f"over {motion.correlation_time:.3g} s"
        fast = (
            f"; changes within {motion.followed_time:.2g} s are the gears' own or noise"
        )
        drift = f"none written: {seen} {time}, {grade_text}{fast}"
        if fitted.drift is not None:
            spread = f"{100 * fitted.drift:.4f} % (standard deviation)"
            drift = f"{spread} {time}; {seen}, {grade_text}"
    elif motion.detection_limit is not None:
        limit = f"{100 * motion.detection_limit:.4f} %"
        drift = f"none written: below the detection limit of {limit}"
    speed = 60.0 * motion.mesh_frequency / n_driving
    quality = (
        f"{grade.grade:.1f}, 90 % of simulated sets of gears: "
        f"{grade.low:.1f} to {grade.high:.1f}"
    )
    if not grade.is_bounded:
        quality += "; NOT BOUNDED: no grade from 1 to 11 gives such sidebands, or none are heard"
    heard = ", ".join(
        f"{name} {100 * row.mean():.0f} %"
        for name, row in zip(fitted.sensors, fitted.heard, strict=True)
    )
    snr = ", ".join(
        f"{name} {ratio:.1f} dB"
        for name, ratio in zip(fitted.sensors, fitted.snr, strict=True)
    )
    return [
        ("speed", f"{speed:.4f} r/min, mesh {motion.mesh_frequency:.4f} Hz"),
        ("drift", drift),
        ("ISO 1328 grade", quality),
        ("path", f"share of bands in which the gears are heard: {heard}"),
        ("signal to noise", snr),
    ]


def check_table(check: Check) -> Table:
    """The held-out check, sensor by sensor."""
    rows = []
    itself = np.median(np.abs(check.fitted_db - check.measured_db), axis=1)
    for index, sensor in enumerate(check.sensors):
        size = np.abs(check.difference_db[index])
        cells = [
            sensor,
            f"{100 * check.share_within[index]:.0f} %",
            f"{np.median(size):.1f} dB",
            f"{size.max():.1f} dB at {check.band[int(size.argmax())]:.0f} Hz",
            f"{itself[index]:.1f} dB",
        ]
        for number, unit in enumerate(INDICATOR_UNITS):
            twin = check.twin[:, index, number]
            value = f"{check.measured[index, number]:.2f} {unit}".strip()
            word = VERDICTS[bool(check.agrees[index, number])]
            cells.append(f"{value} in {twin.min():.2f}..{twin.max():.2f}: {word}")
        rows.append(cells)
    head = (
        "sensor",
        "bands within",
        "median difference",
        "largest",
        "machine against itself",
        *INDICATORS,
    )
    return Table(head=head, rows=rows)


def check_summary(check: Check) -> list[str]:
    """The held-out check for a terminal: a line a sensor."""
    names = "".join(f"{name:>16}" for name in INDICATORS)
    lines = [f"{'sensor':<20}{'bands within':>14}{'median off':>12}{names}"]
    for index, sensor in enumerate(check.sensors):
        words = "".join(
            f"{VERDICTS[bool(agrees)]:>16}" for agrees in check.agrees[index]
        )
        off = float(np.median(np.abs(check.difference_db[index])))
        lines.append(
            f"{sensor:<20}{100 * check.share_within[index]:>12.0f} %{off:>9.1f} dB{words}"
        )
    return lines


def verdict(check: Check) -> str:
    """One sentence on what agrees."""
    n_agree, n_all = int(check.agrees.sum()), check.agrees.size
    missed = [
        f"{INDICATORS[number]} of {check.sensors[index]}"
        for index, number in np.argwhere(~check.agrees).tolist()
    ]
    text = (
        f"{100 * check.share_within.mean():.0f} % of third-octave levels and {n_agree} of {n_all} "
        f"indicators lie between the least and the greatest of {N_RECORDS} healthy records of the "
        f"twin; {100 * EXPECTED:.0f} % would, were they of one of them."
    )
    if missed:
        text += f" What does not agree: {', '.join(missed)}."
    return text


def report_text(
    name: str,
    fitted: Fit,
    check: Check,
    assumed: Mapping[str, str],
    held_out: str,
    n_driving: int,
    words: Sequence[str],
) -> str:
    """The report in Markdown."""
    found = Table(head=("what", "value"), rows=fitted_rows(fitted, n_driving))
    given = Table(head=("key", "where it is from"), rows=[*assumed.items()])
    how = (
        f"{held_out}, {check.duration:.3g} s, and {N_RECORDS} healthy records of the twin, each of "
        "another set of gears. Third-octave levels from "
        f'{check.band[0]:.0f} to {check.band[-1]:.0f} Hz. "Machine against itself" is the median '
        "difference between the held-out stretch and the one fitted to. A range is that of the "
        "twin's records."
    )
    files = (
        "The files that the options name stand in this folder by their whole path: after moving "
        f"it, change `path.file` and `noise.parts` in `sensing/{name}.yaml`."
    )
    picture = [("report.png", "levels")]
    return page_text(
        f"{name}: a twin fitted to healthy measurements",
        [
            f"`gensig generate --config-dir {name} experiment={name} out=runs/{name}` makes its "
            f"data set.\nMade by: `gensig twin {' '.join(words)}`"
        ],
        [
            Section(title="Fitted", table=found),
            Section(title="Given or assumed", table=given),
            Section(title="Held out", text=[how], table=check_table(check)),
            Section(title="", text=[verdict(check)], figures=picture),
            Section(title="What healthy data cannot tell", text=[UNKNOWN, files]),
        ],
    )
