"""Simulated bundles with exact truth, and what the three experiments of bundle adjustment measure on them.

===============  ====================================================================================
module           holds
===============  ====================================================================================
``scene``        cameras on an arc, points, exact pixels; distances that do not depend on the gauge
``wrong``        wrong observations; one scene adjusted with every loss
``gauges``       one scene adjusted in every gauge; covariances predicted and found
``elimination``  Jacobians as matrices; what a factor costs in a given order
``sparsity``     the arrow matrix, and a walk: problems, and their counts of operations
===============  ====================================================================================
"""
