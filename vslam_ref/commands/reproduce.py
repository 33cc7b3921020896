"""``vslam-ref reproduce``: draw a paper's figure again and judge its claims."""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import add_json, at_least, json_target, write_json

if TYPE_CHECKING:
    from vslam_ref.experiments.framework.claims import Claim
    from vslam_ref.experiments.framework.experiment import Experiment
    from vslam_ref.experiments.framework.reproduce import Reproduced
    from vslam_ref.experiments.framework.scheduler import RunContext

HELP = "draw a paper's figure again, with a verdict on every claim"
EPILOG = """\
examples:
  vslam-ref reproduce iekf-fig2 iekf-fig3
  vslam-ref reproduce --all --quick --out quick --strict
  vslam-ref reproduce iekf-fig2 --runs 100 --seed 7 --jobs 4 --json fig2.json
  vslam-ref reproduce iekf-fig2 --scheduler dask --dask-address tcp://head:8786

'--set' takes the keys of "config" in result.json. Options apply in the order --quick, --runs, --seed, --set.
An interrupted command goes on where it stopped when it is given again.
An experiment on recorded data that are not found is "not run" with --all, and an error if it is asked for.
'runs.npz' holds per-run arrays; "arrays" in result.json says what each of them is.
Exit status: 0 done, whatever the verdicts say; with --strict 1 if a claim is not reproduced; 2 bad input."""

FAILED = "not reproduced"
QUICK = "; quick run: small samples, whose verdicts show that everything works, not who is right"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("ids", nargs="*", metavar="ID", help="experiments; see 'vslam-ref list'")
    parser.add_argument("--all", action="store_true", help="every experiment")
    parser.add_argument("--out", default="out", metavar="DIR", help="where results go (default: %(default)s)")
    parser.add_argument("--quick", action="store_true", help="a small version that takes seconds")
    parser.add_argument(
        "--runs",
        type=at_least(2),
        metavar="N",
        help="Monte Carlo runs in the judged sample; a population behind it is scaled in proportion",
    )
    parser.add_argument("--seed", type=at_least(0), metavar="N", help="root of all randomness")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change a setting; may be repeated"
    )
    parser.add_argument("--jobs", type=at_least(1), metavar="N", help="worker processes (default: all cores)")
    parser.add_argument(
        "--scheduler", choices=["local", "dask"], default="local", help="default: %(default)s"
    )
    parser.add_argument("--dask-address", metavar="URL", help="tcp://host:port of a running Dask scheduler")
    parser.add_argument("--strict", action="store_true", help="exit status 1 if a claim is not reproduced")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Check everything, then run the experiments one after the other."""
    from vslam_ref import _kernels
    from vslam_ref.experiments.framework import reproduce as framework
    from vslam_ref.support import files

    work, not_run = _work(options)
    context = _context(options)
    target = json_target(options)
    out = files.require_folder(options.out)

    def begin(number: int, experiment: Experiment[Any]) -> None:
        print(f"[{number}/{len(work)}] {experiment.id}: {experiment.title}", file=sys.stderr, flush=True)

    print(f"backend {_kernels.backend()}{QUICK if options.quick else ''}", flush=True)
    outcomes = []
    for outcome in framework.reproduce(work, context, out, options.quick, begin):
        _print_outcome(outcome)
        outcomes.append(outcome)
    for id, names in not_run.items():
        print(f"not run         {id}: {_where(names)}", flush=True)
    verdicts = [claim.verdict for outcome in outcomes for claim in outcome.claims]
    _print_summary(verdicts, len(not_run), out)
    write_json(target, _numbers(outcomes, not_run, out))
    return 1 if options.strict and FAILED in verdicts else 0


def _work(
    options: argparse.Namespace,
) -> tuple[list[tuple[Experiment[Any], Any]], dict[str, Sequence[str]]]:
    """Each experiment with its config, and those that lack data; ``InputError`` before anything has run."""
    from vslam_ref.experiments.registry import load, summaries
    from vslam_ref.support.errors import InputError

    if options.all == bool(options.ids):
        raise InputError(
            "give the ids of experiments or --all, one of the two; 'vslam-ref list' shows the ids"
        )
    ids = [s.id for s in summaries()] if options.all else list(dict.fromkeys(options.ids))
    experiments = [load(id) for id in ids]
    work = [(experiment, _configure(experiment, options)) for experiment in experiments]
    missing = {experiment.id: names for experiment, config in work if (names := experiment.missing(config))}
    if missing and not options.all:
        raise InputError("; ".join(f"{id}: {_where(names)}" for id, names in missing.items()))
    return [each for each in work if each[0].id not in missing], missing


def _where(names: Sequence[str]) -> str:
    """Say which data are missing."""
    from vslam_ref.datasets.catalogue import VARIABLE

    many = len(names) > 1
    sets, it = f"data set{'s' if many else ''} {', '.join(names)}", "them" if many else "it"
    return f"needs the {sets}, not found in {VARIABLE}; 'vslam-ref data' says where to get {it}"


def _configure(experiment: Experiment[Any], options: argparse.Namespace) -> Any:
    """Apply the options; with ``--all``, an experiment without runs or seed ignores these two."""
    from vslam_ref.support.config import find_setting

    default = experiment.default()
    runs, seed = options.runs, options.seed
    if options.all:
        runs = runs if find_setting(default, "runs") else None
        seed = seed if find_setting(default, "seed") else None
    return experiment.configure(quick=options.quick, runs=runs, seed=seed, overrides=options.set)


def _context(options: argparse.Namespace) -> RunContext:
    from vslam_ref.experiments.framework.scheduler import RunContext, check_scheduler, cores, dask_client

    jobs = options.jobs or cores()
    check_scheduler(options.scheduler, options.dask_address, jobs)
    if options.scheduler == "dask":
        with dask_client(options.dask_address):
            pass  # a cluster that cannot be reached is reported now, not after the first experiment
    return RunContext(jobs, options.scheduler, options.dask_address, progress=True)


def _print_outcome(outcome: Reproduced) -> None:
    from vslam_ref.experiments.framework.claims import WORST_FIRST

    for claim in sorted(outcome.claims, key=lambda c: WORST_FIRST.index(c.verdict)):
        print("\n".join(_claim_lines(outcome.experiment.id, claim)))
    took = f"{outcome.seconds:.1f} s"
    if outcome.shares_with is not None:
        took = f"shares its runs with {outcome.shares_with}"
    print(f"{outcome.experiment.id}: {took}, files in {outcome.folder}", flush=True)


def _claim_lines(experiment: str, claim: Claim) -> list[str]:
    """Verdict, id, share and the paper's sentence; then what was found, and whether the sample is small."""
    from vslam_ref.experiments.framework.claims import small_sample_note

    share = "share  -  " if claim.share is None else f"share {claim.share:.3f}"
    text = textwrap.shorten(claim.text, 80, placeholder=" ...")
    lines = [f"{claim.verdict:<14}  {experiment}/{claim.id}  {share}  {text}"]
    for words in (claim.sentence, small_sample_note(claim.to_dict())):
        lines += textwrap.wrap(words, 104, initial_indent=" " * 16, subsequent_indent=" " * 16)
    return lines


def _print_summary(verdicts: Sequence[str], not_run: int, out: Path) -> None:
    from vslam_ref.experiments.framework.claims import VERDICTS

    counts = ", ".join(f"{verdicts.count(v)} {v}" for v in VERDICTS)
    rest = f"; {not_run} experiment{'s' if not_run > 1 else ''} not run" if not_run else ""
    print(f"{len(verdicts)} claims: {counts}{rest}; open {out / 'index.html'}", flush=True)


def _numbers(outcomes: Sequence[Reproduced], not_run: dict[str, Sequence[str]], out: Path) -> dict[str, Any]:
    """Return what was printed, as ``--json`` writes it."""
    return {
        "out": str(out),
        "not_run": [{"experiment": id, "missing": list(names)} for id, names in not_run.items()],
        "experiments": [
            {
                "experiment": o.experiment.id,
                "seed": o.seed,
                "runs": o.runs,
                "quick": o.quick,
                "seconds": o.seconds,
                "shares_with": o.shares_with,
                "folder": str(o.folder),
                "claims": [claim.to_dict() for claim in o.claims],
            }
            for o in outcomes
        ],
    }
