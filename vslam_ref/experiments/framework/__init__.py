"""What every experiment shares: settings with reasons, claims with verdicts, results on disk.

An experiment is one module ``vslam_ref/experiments/<id with _ for ->.py``::

    @dataclass(frozen=True)
    class Config:
        runs: int = field(default=50, metadata={"reason": "the paper's number", "unit": ""})
        seed: int = field(default=1, metadata={"reason": "any; fixed for repeatability"})

    def run(config: Config, context: RunContext) -> Result: ...
    def claims(result: Result) -> list[Claim]: ...
    def figure(result: Result) -> Figure: ...

    EXPERIMENT = Experiment(id="iekf-fig2", title="...", source="...", config_type=Config,
                            run=run, claims=claims, figure=figure, quick=quick)

==============  ==========================================================================
module          holds
==============  ==========================================================================
``claims``      ``Claim`` and its verdict
``experiment``  ``Experiment`` and ``RunContext``
``registry``    from an id to its experiment, imported on first use
``results``     ``Result``: what a run returns
``scheduler``   ``run_batches`` on one core, many cores or a Dask cluster
``writer``      ``OUT/<id>/{figure.svg,figure.png,result.json,runs.npz}``
``report``      ``OUT/index.html``
``reproduce``   all of it in order
==============  ==========================================================================
"""

from vslam_ref.experiments.framework.claims import Claim, Verdict, verdict
from vslam_ref.experiments.framework.experiment import Experiment, RunContext, scale_runs
from vslam_ref.experiments.framework.registry import load, register, summaries, unregister
from vslam_ref.experiments.framework.results import Result
from vslam_ref.experiments.framework.scheduler import run_batches
from vslam_ref.support.config import apply_overrides, assumptions, config_to_dict
from vslam_ref.support.errors import InputError

__all__ = [
    "Claim",
    "Experiment",
    "InputError",
    "Result",
    "RunContext",
    "Verdict",
    "apply_overrides",
    "assumptions",
    "config_to_dict",
    "load",
    "register",
    "run_batches",
    "scale_runs",
    "summaries",
    "unregister",
    "verdict",
]
