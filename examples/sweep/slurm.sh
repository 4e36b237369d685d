#!/usr/bin/env bash
# One job of a sweep for each task of a Slurm array; begun again, a job that has its result returns at once:
#
#   touchup sweep plan grid.yaml --out jobs.jsonl
#   sbatch --wait --array=0-$(($(wc -l < jobs.jsonl) - 1)) slurm.sh jobs.jsonl results
#   touchup sweep table jobs.jsonl --results results --out table.csv
#
#SBATCH --job-name=touchup
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=500
#SBATCH --requeue
#SBATCH --output=slurm_%a.log
touchup sweep run "$1" --job "$SLURM_ARRAY_TASK_ID" --results "$2"
code=$?
# 3: refinement is impossible, and the table says why; 4: refined from a damaged recording, and done
[ $code -eq 4 ] || exit $code
