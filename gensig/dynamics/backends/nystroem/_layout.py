"""Row names of the scratch of the two-evaluation core.

The scratch of a mesh begins with the rows of ``gensig.dynamics._layout``, of which the back flanks
use some. Rows follow for the pairs and for what the step remembers. Those of the machine are behind
the rows of all meshes, a block for each degree of freedom.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout

# N/m: rows hold compliances times this number, which are about 1
PER_COMPLIANCE = 2.0**27
FOLLOWED = 3  # pairs within one and a half base pitches of the middle of the path

# rows of a pair at one instant: own compliance, its slope, gap, its slope, direction of sliding,
# position, integral of the direction
COMPLIANCE, SOFTENING, GAP, GAP_SLOPE, SLIDING, PLACE, SLID, N_NODE = range(8)

# rows behind those of the mesh
NODES = layout.N_MESH  # of every pair: at the end of the last step
MIDDLE = NODES + FOLLOWED * N_NODE  # of every pair: in the middle of the step
# of every pair at the begin, in the middle and at the end of a step: force it has, negative where
# it does not touch, stiffness, and factor of its damping
BEGIN_AT, MIDDLE_AT, END_AT, N_INSTANTS = range(4)
MARGIN = MIDDLE + FOLLOWED * N_NODE
SPRING = MARGIN + N_INSTANTS * FOLLOWED
DAMPED = SPRING + N_INSTANTS * FOLLOWED
PAIR_FORCE = DAMPED + N_INSTANTS * FOLLOWED
NORMAL = PAIR_FORCE + FOLLOWED  # force of all pairs
# roll at which the nodes at the begin of the step were read, less the true one
BEHIND = NORMAL + 1
# half a table cell, and half the length over which sliding turns, m
BEND, FRICTION_WIDTH = BEHIND + 1, BEHIND + 2
FRESH = FRICTION_WIDTH + 1  # 1 where rows are being set anew
# corrections of every pair's force by a kink: of its mean, and of its mean weighted by what is
# left of the step
SHORT = FRESH + 1
EARLY = SHORT + FOLLOWED
DRIVE = EARLY + FOLLOWED
PULL = DRIVE + layout.N_DRIVE  # of the governor
# of meshes of any law: 1 where kinks are corrected; and blocks of a row per pair: margins at begin,
# middle and end of the step, damping in its middle, and the corrections by kinks
ANY_MISSED = PULL + 1
ANY_MARGIN = ANY_MISSED + 1
ANY_DAMPED = ANY_MARGIN + N_INSTANTS * layout.MOST_PAIRS
ANY_SHORT = ANY_DAMPED + layout.MOST_PAIRS
ANY_EARLY = ANY_SHORT + layout.MOST_PAIRS
N_FIXED = ANY_EARLY + layout.MOST_PAIRS
# rows of a pair of helical teeth in the slot ``PART``, which this core has no other use for: what
# another chord adds to its force and to its stiffness at the begin of the step, and the penetration
MORE_FORCE, MORE_STIFFNESS, BITTEN = layout.COMPLIANCE, layout.STIFFNESS, layout.GAP
# rows of a degree of freedom
Q, V, MIDDLE_Q, MIDDLE_V, END_Q, END_V = range(6)
# accelerations at begin and middle of the last step and at its end, forces that follow time alone,
# mean acceleration over the step, and the sum of all forces
BEFORE, HALFWAY, NOW, FORCES, MEAN, ON, N_BLOCKS = range(6, 13)

# float64 rows behind those of ``gensig.dynamics._layout``: position and number of every pair,
# its tables' first indices, and numbers of the tables
POSITION = layout.N_WIDE
NUMBER = POSITION + FOLLOWED
AT_PINION, AT_WHEEL = NUMBER + FOLLOWED, NUMBER + 2 * FOLLOWED
PER_CELL = AT_WHEEL + FOLLOWED  # 0 where the pair lacks a tooth
PER_WHEEL_CELL = PER_CELL + FOLLOWED
LAST_CELL = PER_WHEEL_CELL + FOLLOWED
N_WIDE = LAST_CELL + 1

# integer rows behind those of ``gensig.dynamics._layout``: the newest pair at the last margins
MARGINS_OF = layout.N_COUNTS
# 1 in its first place if a pair or a chord changes in the step
RECHOSEN = MARGINS_OF + 1
N_COUNTS = RECHOSEN + 1
