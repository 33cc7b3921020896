"""What every experiment shares: settings with reasons, runs, claims with verdicts, results on disk.

An experiment is a module ``vslam_ref/experiments/<family>/<name>.py``: data, and a few functions::

    @dataclass(frozen=True)
    class Config:
        runs: int = field(default=50, metadata={"reason": "the paper's number", "unit": ""})
        seed: int = field(default=1, metadata={"reason": "any; fixed for repeatability"})

    class Run(NamedTuple):
        error: Array

    def simulate(config: Config, point: object, seed: SeedSequence) -> Run: ...   # one run, from one seed
    def series(study: Study[Run]) -> dict[str, object]: ...   # study.data.error: (runs, ...)
    def claims(study: Study[Run]) -> list[Claim]: ...
    def figure(study: Study[Run]) -> Figure: ...

    EXPERIMENT = Experiment(id="family-name", title="...", source="...", config_type=Config,
                            simulate=simulate, series=series, claims=claims, figure=figure,
                            about={"error": "..., (runs,)"}, quick={"runs": 5})

==============  ==========================================================================
module          holds
==============  ==========================================================================
``claims``      ``Claim`` with its verdict and its sentence
``statistics``  intervals over whole runs
``experiment``  ``Experiment``
``driver``      tasks and seeds out of a design; ``Study``, all runs stacked
``scheduler``   ``RunContext``: one core, many cores or a Dask cluster
``progress``    runs done of runs asked; the one compilation
``kept``        finished batches of a run that may be interrupted
``writer``      ``OUT/<id>/{figure.svg,figure.png,result.json,runs.npz}``
``report``      ``OUT/index.html``
``reproduce``   all of it in order
==============  ==========================================================================
"""

from vslam_ref.experiments.framework.claims import Claim, Verdict, between, judged, verdict
from vslam_ref.experiments.framework.driver import Study, batches, child_seeds
from vslam_ref.experiments.framework.experiment import Experiment, scale_runs
from vslam_ref.experiments.framework.scheduler import RunContext, run_batches
from vslam_ref.experiments.registry import load, register, summaries, unregister

__all__ = [
    "Claim", "Experiment", "RunContext", "Study", "Verdict", "batches", "between", "child_seeds", "judged",
    "load", "register", "run_batches", "scale_runs", "summaries", "unregister", "verdict",
]  # fmt: skip
