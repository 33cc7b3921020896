"""What the three experiments of bundle adjustment measure: ``bundle-tukey``, ``-gauge`` and ``-sparsity``.

===============  ====================================================================================
module           holds
===============  ====================================================================================
``wrong``        wrong observations; one scene adjusted with every loss
``gauges``       one scene adjusted in every gauge; covariances predicted and found
``elimination``  Jacobians as matrices; what a factor costs in a given order
``counts``       the arrow matrix, and a walk: problems, and their counts of operations
===============  ====================================================================================

The scenes with exact truth are those of ``worlds.bundles``.
"""
