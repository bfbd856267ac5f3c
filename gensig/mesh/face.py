"""Contact over the face of a faulty flank: bearing slices, their gaps and compliance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array, Integers
from gensig.errors import FaultError
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.mesh._kernels import lower_envelope, share_over_slices
from gensig.mesh.local_contact import ContactLaw

SHAPE_DECIMALS = 15  # of a metre: rounding noise does not make two slices different
# law=paper has no gaps: flank deeper than this share of the module does not bear
LOST_DEPTH = 0.04


def is_nominal(tooth: Tooth) -> bool:
    """True for a flank without lost material and without deviation."""
    return not (tooth.material_loss.any() or tooth.flank_deviation.any())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlankContacts:
    """Nominal contacts of a flank, each position once.

    Parameters
    ----------
    center : (contact,) m    along the involute; may lie beyond the tip, whose corner then touches
    relative_radius : (contact,) m    of both flanks there
    of_phase : (phase,)    index of the contact
    content : bytes of ``center`` and ``relative_radius``
    """

    center: Array
    relative_radius: Array
    of_phase: Integers
    content: tuple[bytes, bytes]


def flank_contacts(
    gear: Gear, curvature_radius: Array, relative_radius: Array
) -> FlankContacts:
    """Contacts of a gear's flank at curvature radii, (phase,) m; most phases are held at A or E."""
    different, first, of_phase = np.unique(
        curvature_radius, return_index=True, return_inverse=True
    )
    center, radius = different**2 / (2.0 * gear.base_radius), relative_radius[first]
    for values in (center, radius):
        values.flags.writeable = False
    return FlankContacts(
        center=center,
        relative_radius=radius,
        of_phase=of_phase,
        content=(center.tobytes(), radius.tobytes()),
    )


def slice_gaps(tooth: Tooth, contacts: FlankContacts) -> Array:
    """Gap of each slice beyond that of a healthy flank, (slice, phase) m.

    The mate rides on the edges of a hole: the gap is the lower envelope of both flanks along the
    common tangent, not the removed depth. The new corner of a flank without its tip touches.
    """
    center = contacts.center
    arc = tooth.profile.curvature_radius**2 / (2.0 * tooth.gear.base_radius)
    standing_back = tooth.material_loss + tooth.flank_deviation
    level = standing_back[:, :1]
    even = np.all(standing_back == level, axis=1)
    gap = np.repeat(level, len(center), axis=1)
    if not even.all():
        shapes, which, moved = _shapes(standing_back[~even])
        # the end of a nominal flank touches
        beyond = np.maximum(np.maximum(center - arc[-1], arc[0] - center), 0.0)
        nodes = arc.tobytes(), *contacts.content
        touched = np.stack([_envelope(shape.tobytes(), *nodes) for shape in shapes])
        uneven = touched - beyond**2 / (2.0 * contacts.relative_radius)
        gap[~even] = uneven[which] + moved
    return gap[:, contacts.of_phase]


# a record needs the flanks of its unit again, at other loads; 128 rows of 512 nodes a pitch, with
# what they are known by, take 6 MB at most
@lru_cache(maxsize=128)
def _envelope(
    standing_back: bytes, arc: bytes, center: bytes, relative_radius: bytes
) -> Array:
    """Lower envelope of one slice, (contact,) m, read-only.

    The arguments are the bytes of those of ``lower_envelope``: kept by content.
    """
    back, *nodes = (
        np.frombuffer(values).copy()  # as the compiled function takes them
        for values in (standing_back, arc, center, relative_radius)
    )
    gap = np.empty((1, len(nodes[1])))
    lower_envelope(back[None], *nodes, gap)
    gap.flags.writeable = False
    return gap[0]


def _shapes(standing_back: Array) -> tuple[Array, Integers, Array]:
    """Distinct shapes of the rows without their offsets, index of each row's shape, and offsets.

    Slices of a flank that is only moved or tilted across the face share their envelope.
    """
    moved = np.where(np.isfinite(standing_back[:, :1]), standing_back[:, :1], 0.0)
    known: dict[bytes, int] = {}
    first: list[int] = []
    which: list[int] = []
    for number, row in enumerate(np.round(standing_back - moved, SHAPE_DECIMALS)):
        which.append(known.setdefault(row.tobytes(), len(known)))
        if len(known) > len(first):
            first.append(number)
    shape_of_row = np.array(which, dtype=np.int64)
    return standing_back[first] - moved[first], shape_of_row, moved


def face_contact(
    tooth: Tooth,
    contacts: FlankContacts,
    law: ContactLaw,
    load: Array,
    bending: Array,
) -> tuple[Array, Array]:
    """Gap of the slice that touches first, and compliance from there, (phase,) m and m/N.

    The compliance is that of the contact plus the bending that partial width adds.

    Parameters
    ----------
    load : (phase,) N    at which the secant is taken
    bending : (phase,) m/N    of both teeth over the whole face, if slices bend alone; else 0
    """
    gaps = slice_gaps(tooth, contacts)
    if len(gaps) == 1 and np.isfinite(gaps).all():  # bears as a healthy flank
        return gaps[0], law.compliance(tooth.gear.face_width, load)
    gap, compliance = np.empty_like(load), np.empty_like(load)
    unit = bending * tooth.gear.face_width
    share_over_slices(
        gaps,
        tooth.slice_width,
        load,
        law.factor,
        law.constant,
        law.log_weight,
        unit,
        gap,
        compliance,
    )
    return gap, compliance


def bearing_width(tooth: Tooth, curvature_radius: Array) -> Array:
    """Width in contact by the paper's law, which has no gaps: the face less lost parts, (phase,) m.

    Raises
    ------
    FaultError    where no width is left, since only a law with gaps finds the contact there
    """
    loss = tooth.material_loss
    whole = loss <= loss.min() + LOST_DEPTH * tooth.gear.normal_module
    width = tooth.slice_width @ whole
    if np.any(width <= 0.0):
        raise FaultError(
            f"a {tooth.gear.name} tooth has lost its flank over the whole face width: "
            "mesh.law=paper knows no gaps, take mesh.law=one_sided"
        )
    return np.interp(curvature_radius, tooth.profile.curvature_radius, width)
