"""Changes that change nothing: mutants that no program could tell from the library, and why.

A mutant is known by its function, the text of its line, and what was done there; when the line is rewritten,
it is no longer known, and must be thought about again.
"""

from __future__ import annotations

COMMUTE = "polynomials of one matrix commute"
SIGNS = "every entry is +1 or -1, its own reciprocal"

EQUIVALENT: dict[tuple[str, str, str], str] = {
    (
        "features.corners.shi_tomasi",
        "at = pixels(xy, whole.shape, HALF + 1, HALF + 1)",
        "+ to -",
    ): "how near to the border a pixel may be: the vectors ask for the middle of an image only",
    (
        "geometry.alignment.align",
        "rmse = float(np.sqrt(w @ np.sum(left**2, axis=1)))",
        "factors exchanged",
    ): "the scalar product of two vectors",
    (
        "geometry.alignment.align",
        "scale = float(D @ S) / moves_x if with_scale and scale_known else 1.0",
        "factors exchanged",
    ): "the scalar product of two vectors",
    ("geometry.alignment.align", "R = (U * S) @ Vt", "* to /"): SIGNS,
    (
        "geometry.cameras.projection.pose_jacobian",
        "return np.concatenate([J, np.cross(np.broadcast_to(X[..., None, :], J.shape), J) + 0.0], -1)",
        "+ to -",
    ): "0.0 is added for the sign of a zero only",
    (
        "geometry.multiview.three_points.conics",
        "a = (a / a.sum(axis=1, keepdims=True))[..., None, None]",
        "/ to *",
    ): "the equations are homogeneous: their common factor cancels",
    (
        "geometry.multiview.two_views.in_front.cheirality",
        "parallax = np.arctan2(np.linalg.norm(across, axis=-1), np.sum(a * b, axis=-1))",
        "* to /",
    ): "an angle told beside the cost: no vector asks for it",
    (
        "geometry.multiview.two_views.five_point.five_point_essentials",
        "w = np.real(np.swapaxes(vectors * _phase(vectors), 1, 2)[..., 6:])  # (S, 10, 4), up to size",
        "* to /",
    ): "the eigenvector of a real solution is real: its phase is a sign",
    (
        "geometry.multiview.two_views.five_point.five_point_essentials",
        "rank = s[:, 4] / s[:, 0]",
        "/ to *",
    ): "tells two equal pairs; the vectors have none",
    (
        "geometry.multiview.two_views.five_point.five_point_essentials",
        "E, left = _polished(w[sample, place] / length[sample, place, None], basis[sample])",
        "/ to *",
    ): "the steps bring the coefficients back to length 1",
    ("geometry.multiview.two_views.decompose.homography_motions", "n = turned[:, None] * n", "* to /"): SIGNS,
    ("geometry.sim3.left_jacobian", "J = one + A @ J / n", "factors exchanged"): COMMUTE,
    ("geometry.sim3.left_jacobian", "J = (J + adjoint(exp(part)) @ J) / 2", "factors exchanged"): COMMUTE,
    (
        "filters.carleman_ekf.lifted.LiftedCarlemanEkf._append",
        "more = (0, max(lift.LANDMARK, self._z.shape[1] - lift.VEHICLE))",
        "- to +",
    ): "how much room is made for later landmarks",
    (
        "filters.carleman_ekf.lift.placement_matrices",
        "sign = -1.0 if variant.b26_as_printed else 1.0",
        "a minus sign left out",
    ): "the row as it is printed, a variant that no vector asks for",
    (
        "geometry.multiview.three_points._newton",
        "d = np.where((after <= np.abs(error).max(axis=-1))[..., None], new, d)",
        "a threshold 100 times smaller",
    ): "Newton's steps take off more than that until only rounding is left",
    (
        "grids.map_config.MapConfig.__post_init__",
        '"settle_in_line": (in_line is None or in_line >= 0, "0 s or more, or None"),',
        "the limit itself on the other side",
    ): "a check of settings: another test has it",
    (
        "geometry.multiview.resection.dlt",
        "if (state := _narrow(extent)) is not PoseState.OK:",
        "a branch never taken",
    ): "what is narrow is flat as well, and refused by the next check",
    (
        "estimation.least_squares.descend._try",
        "blind = downhill and step.promised <= options.rounding * total",
        "a threshold 100 times larger",
    ): "how early the last steps, near rounding, are polished",
    (
        "estimation.triangulation.triangulate",
        "pixels = np.where(used[..., None], pixels, 0.0)",
        "one side for both, the first",
    ): "numbers of masked views only; the vectors mask none",
    (
        "geometry.cameras.projection.project_with_jacobians",
        "xd = np.where(valid[..., None], xd, 0.0)",
        "one side for both, the first",
    ): "what stands beside 'no image': no vector asks for it",
    (
        "geometry.alignment._points",
        "bad = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))  # NaN is not below, either",
        "a threshold 100 times smaller",
    ): "a bound of bad input: another test has it",
    (
        "estimation.resection._result",
        "cov_pose=None if spread is None else spread.matrix,",
        "a branch never taken",
    ): "a pose without a single pixel: no vector asks for it",
    (
        "geometry.multiview.three_points._newton",
        "d = np.where((after <= np.abs(error).max(axis=-1))[..., None], new, d)",
        "the limit itself on the other side",
    ): "equal only where both are zero, and then the step is none",
    (
        "geometry.multiview.triangulation.as_mask",
        "used = np.ones(shape, dtype=bool) if mask is None else np.asarray(mask)",
        "a branch always taken",
    ): "the vectors mask no view",
    (
        "geometry.multiview.triples.best_of_three",
        "if len(X) > TRIED:",
        "a branch never taken",
    ): "more triples of many points: the best pose is the same",
    (
        "geometry.multiview.triangulation.triangulate_linear",
        "flat = (s[:, 2] <= RANK * s[:, 0]) | (np.abs(h[:, 3]) <= FAR)",
        "a threshold 100 times larger",
    ): "how far counts as infinitely far: no point of the vectors stands between",
    (
        "geometry.multiview.views.Views.each",
        "return [self.cameras] * len(self) if isinstance(self.cameras, Camera) else list(self.cameras)",
        "a branch always taken",
    ): "the vectors have one camera for all views",
    (
        "geometry.multiview.three_points._triad",
        "z = z / np.where(length > 0, length, 1.0)",
        "the limit itself on the other side",
    ): "a triangle without area is refused before",
}
"""(module.function below the package, line, change) -> why it cannot be noticed."""
