"""Time to tabulate the mesh of one faulty gear pair: ``python -m benchmarks.mesh_tables``.

Cold forgets what is kept of sound teeth and bodies, as for the first record of a geometry; warm
is the first of every further condition, whose other records find the load of its pairs too. CPU
time, the least of several runs, compiled code loaded.
"""

from __future__ import annotations

import argparse
import time

from gensig.faults.base import faulty_teeth
from gensig.faults.registry import read_faults
from gensig.geometry import tooth
from gensig.mesh import body_coupling, face, pair_table
from gensig.mesh.load_distribution import loaded_pair_table, sound_load
from gensig.options.groups import options
from gensig.plan.request import read_request
from gensig.systems.registry import read_system

KEPT = (
    pair_table._sound_mesh,
    tooth.healthy_tooth,
    body_coupling.shared_body_compliance,
    body_coupling.arc_flexibility,
)


def least_seconds(words: list[str], runs: int, *, cold: bool) -> float:
    """Faulty teeth, load rounds and table of one configuration, s."""
    config = read_request(words).config
    system, faults = read_system(config), read_faults(config["fault"])
    least = float("inf")
    for _ in range(runs):
        sound_load.cache_clear()
        face._envelope.cache_clear()  # the faults of every record are new
        if cold:
            for kept in KEPT:
                kept.cache_clear()
        start = time.process_time()
        teeth = faulty_teeth(system.pair, faults)
        loaded_pair_table(
            system.pair, system.material, system.mesh, teeth, force=system.mesh_force
        )
        least = min(least, time.process_time() - start)
    return least


def main() -> None:
    """One line a fault option."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--runs", type=int, default=10, help="the least of so many (default 10)"
    )
    runs = parser.parse_args().runs
    print(f"{'fault':<40}{'cold ms':>10}{'warm ms':>10}")
    for name in (*options("fault"), "distributed_pitting fault.tooth=0"):
        words = f"fault={name}".split()
        least_seconds(words, 1, cold=False)
        cold, warm = (
            1e3 * least_seconds(words, runs, cold=state) for state in (True, False)
        )
        print(f"{name:<40}{cold:>10.1f}{warm:>10.1f}")


if __name__ == "__main__":
    main()
