"""Bundle adjustment (work in progress)."""

from vslam_ref.estimation.bundle.problem import BundleProblem, Freedom, Observations, Scene, freedom

__all__ = ["BundleProblem", "Freedom", "Observations", "Scene", "freedom"]
