"""Designs of many variants and diagnoses of many logs on Ray or Dask: resumable, results as Parquet.

    pip install ray pyarrow pandas          # or: pip install "dask[distributed]" pyarrow pandas
    python study.py ray  study --variants 200 --logs 100 --workers 2
    python study.py dask study --variants 200 --logs 100 --workers 2

Every task is a pure function of its arguments, which can be pickled, and writes one row to a file of its own. A task whose file
is there is not run again: stop the study whenever you like and start it again with the same command. At the end the rows become
designs.parquet and diagnoses.parquet.
"""

import argparse
import json
import os
import warnings
from pathlib import Path

#: A bundled robot; a path works as well, where every worker finds it.
ROBOT = "planar2"


def design(folder: str, seed: int) -> str:
    """One variant of the motion: other seed, other period."""
    import excite

    path = Path(folder, f"design_{seed}.json")
    if path.exists():
        return str(path)
    period = 4.0 + seed % 5
    plan = excite.design(ROBOT, seed=seed, starts=1, period=period, harmonics=3, collision=False, threads=1, progress=False)
    row = {
        "seed": seed,
        "period": period,
        "status": plan.status,
        "condition_number": plan.condition_number["invariant"],
        "trajectory": plan.trajectory.to_json(),
    }
    return finished(path, row)


def diagnose(folder: str, log: int, trajectory: str) -> str:
    """One log: a robot with more friction than its model on one joint, and what the diagnosis says of it."""
    import excite

    path = Path(folder, f"diagnosis_{log}.json")
    if path.exists():
        return str(path)
    robot = excite.Robot.load(ROBOT)
    joint = robot.joints[log % len(robot.joints)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", excite.ExciteWarning)
        records = []
        for seed, use in ((2 * log, "fit"), (2 * log + 1, "holdout")):
            run = excite.simulate(
                robot, excite.Trajectory(trajectory), periods=2, rate=250.0, perturb=0.05, seed=seed, stribeck_friction={joint: [2.0, 0.1]},
                progress=False,
            )
            records.append(run.record(use))
        found = excite.diagnose(excite.Experiment(robot, records), next=False, progress=False)
        # factors of all logs together give the model of the fleet
        factor = excite.condense(excite.Experiment(robot, records), cutoff=15.0)
    factor.save(Path(folder, f"log_{log}.factor"), force=True)
    first = found.findings[0] if found.findings else {}
    row = {
        "log": log,
        "hidden_on": joint,
        "verdict": found.verdict,
        "effect": first.get("effect"),
        "joints": ", ".join(first.get("joints", [])),
        "confidence": first.get("confidence"),
        "explains": first.get("explains"),
    }
    return finished(path, row)


def finished(path: Path, row: dict) -> str:
    """Writes a row whole or not at all."""
    part = path.with_suffix(f".{os.getpid()}.part")
    part.write_text(json.dumps(row))
    part.replace(path)
    return str(path)


class OnRay:
    """A local cluster of Ray; ``address=`` of :func:`ray.init` names another one."""

    def __init__(self, workers: int) -> None:
        import ray

        self.ray = ray
        ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False)

    def map(self, function, arguments):
        remote = self.ray.remote(function)
        return self.ray.get([remote.remote(*a) for a in arguments])

    def close(self) -> None:
        self.ray.shutdown()


class OnDask:
    """A local cluster of Dask; ``Client(address)`` is another one."""

    def __init__(self, workers: int) -> None:
        from dask.distributed import Client, LocalCluster

        self.cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
        self.client = Client(self.cluster)

    def map(self, function, arguments):
        return self.client.gather([self.client.submit(function, *a, pure=False) for a in arguments])

    def close(self) -> None:
        self.client.close()
        self.cluster.close()


def table(paths, to: Path):
    """Rows of files as a Parquet file."""
    import pandas

    rows = pandas.DataFrame([json.loads(Path(p).read_text()) for p in paths])
    rows.to_parquet(to)
    return rows


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("cluster", choices=["ray", "dask"])
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--variants", type=int, default=200)
    arguments.add_argument("--logs", type=int, default=100)
    arguments.add_argument("--workers", type=int, default=2)
    given = arguments.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    folder = str(given.folder.resolve())
    cluster = {"ray": OnRay, "dask": OnDask}[given.cluster](given.workers)
    try:
        designs = table(
            cluster.map(design, [(folder, seed) for seed in range(1, given.variants + 1)]),
            given.folder / "designs.parquet",
        )
        best = designs.loc[designs["condition_number"].idxmin(), "trajectory"]
        diagnoses = table(
            cluster.map(diagnose, [(folder, log, best) for log in range(given.logs)]),
            given.folder / "diagnoses.parquet",
        )
    finally:
        cluster.close()
    import excite

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", excite.ExciteWarning)
        fleet = excite.merge([Path(folder, f"log_{log}.factor") for log in range(given.logs)])
    fleet.save(given.folder / "fleet", force=True)
    right = (diagnoses["joints"] == diagnoses["hidden_on"]).mean()
    print(f"{len(designs)} designs, condition number {designs['condition_number'].min():.2f} at best")
    print(f"{len(diagnoses)} diagnoses, the joint named in {right:.0%}")
    print(f"the model of all logs leaves {fleet.validation['holdout']['relative_error']:.2%} of the torque on holdout")


if __name__ == "__main__":
    main()
