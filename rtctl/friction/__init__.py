"""Friction models, offline: measured points in, a verified model file out.

    points   the measured speed-friction points of a rig (CSV)
    kernels  kernel functions of the support-vector regressions
    fit      points -> model, with scikit-learn
    compile  spline-kernel SVR -> the exact piecewise cubic
    model    the model in memory: evaluation, compiled record, self-test
    artefact the model file: versioned, checksummed, verified on reading
    margins  what model and feed-forward leave of the device's passivity
    figure   plots

Reading a model (`artefact`, `model`, `compile`) needs NumPy and pydantic only.
"""
