"""Run all benchmarks, one after another, and write one JSON file for each."""

import argparse
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
NAMES = (
    "tiers",
    "tree_dynamics",
    "trajectory_gradient",
    "energy_drift",
    "long_run_energy",
    "closed_loop",
    "iftomm",
    "solvers",
    "rows_of_loops",
    "reactions",
    "optimisers",
    "reliability",
    "substructures",
    "component_chain",
    "elastic_bodies",
    "elastic_costs",
    "batch_of_motions",
    "accelerator",
    "cold_start",
    "compiler_tricks",
    "saved_times",
    "fmu_calls",
    "diffrax_loops",
    "imported_models",
    "wishbone_limits",
    "wishbones_side_by_side",
    "openmdao_component",
    "published_decks",
    "hydraulic_arm",
    "states",
    "contact",
    "joint_friction",
    "cables",
    "cycles",
    "validity",
    "vehicles",
    "qualification",
    "identify_arm",
    "kinds",
    "notebooks",
    "shock_records",
    "study_store",
)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small cases and few repeats")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder (default: benchmarks/results)")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    failed = []
    for name in NAMES:
        print(f"== {name}", flush=True)
        command = [sys.executable, str(HERE / f"{name}.py"), "--json", str(options.output / f"{name}.json")]
        if subprocess.run(command + ["--quick"] * options.quick).returncode:
            failed.append(name)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
