"""Other engines of a sweep, as in examples/sweep: Slurm and Snakemake make the table of one process."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT
from slurm import Slurm
from sweeps import command, files_of, planned, rows_of, table

EXAMPLE = ROOT.parents[1] / "examples/sweep"
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


def serial(jobs):
    command("sweep", "run", jobs, "--results", jobs.parent / "serial")
    return jobs.parent / "serial"


def by_snakemake(jobs, results):
    """Runs the Snakefile; the table that it makes."""
    shutil.copy(EXAMPLE / "Snakefile", jobs.parent)
    snakemake = [sys.executable, "-m", "snakemake", "--cores", "2", "--quiet", "all"]
    config = ["--config", f"jobs={jobs.name}", f"results={results.name}", f"table={results.name}.own.csv"]
    ended = subprocess.run([*snakemake, *config], cwd=jobs.parent, env=ENVIRONMENT, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return (jobs.parent / f"{results.name}.own.csv").read_bytes()


def by_slurm(jobs, results, folder):
    """Runs the array."""
    with Slurm(folder) as slurm:
        array = f"--array=0-{len(rows_of(jobs)) - 1}"
        logs = f"--output={folder}/job_%a.out"
        slurm.environment["PATH"] = ENVIRONMENT["PATH"]
        ended = slurm.run("sbatch", "--wait", array, logs, EXAMPLE / "slurm.sh", jobs, results, cwd=jobs.parent)
        assert ended.returncode == 0, ended.stderr + "\n".join(path.read_text() for path in folder.glob("job_*.out")) + slurm.logs()


@pytest.mark.full
def test_snakemake_makes_the_table_of_one_process(ring, tmp_path):
    jobs = planned(tmp_path, ring, seeds=(1,))
    reference = serial(jobs)
    own = by_snakemake(jobs, tmp_path / "snakemake")
    assert own == table(jobs, reference)[0]
    made = {name: data for name, data in files_of(tmp_path / "snakemake").items() if not name.endswith("/.snakemake_timestamp")}
    assert made == files_of(reference)


def test_slurm_makes_the_table_of_one_process(ring, tmp_path):
    jobs = planned(tmp_path, ring, seeds=(1,))
    reference = serial(jobs)
    (tmp_path / "cluster").mkdir()
    by_slurm(jobs, tmp_path / "slurm", tmp_path / "cluster")
    assert table(jobs, tmp_path / "slurm") == table(jobs, reference)
    assert files_of(tmp_path / "slurm") == files_of(reference)


def test_two_hundred_jobs_have_one_table_whatever_runs_them(ring, tmp_path):
    """Ray on two workers, an array of Slurm and Snakemake."""
    import touchup.ray

    jobs = planned(tmp_path, ring, seeds=range(1, 9), stiffnesses=[15, 18, 20, 22, 25], on_n=[0.25, 0.3, 0.35, 0.4, 0.5])
    assert len(rows_of(jobs)) == 200
    reference = table(jobs, serial(jobs))
    own = by_snakemake(jobs, tmp_path / "snakemake")
    assert (own, table(jobs, tmp_path / "snakemake")) == (reference[0], reference)
    (tmp_path / "cluster").mkdir()
    by_slurm(jobs, tmp_path / "slurm", tmp_path / "cluster")
    assert table(jobs, tmp_path / "slurm") == reference
    touchup.ray.ray.init(num_cpus=2, include_dashboard=False)
    try:
        touchup.ray.run(jobs, tmp_path / "ray")
    finally:
        touchup.ray.ray.shutdown()
    assert table(jobs, tmp_path / "ray") == reference
