"""Side-by-side measurements: each figure next to what it is measured against, in one run, interleaved.

A figure of a shared machine means little alone, so every row is a ratio or stands beside a reference
(cyclictest, scikit-learn, onnxruntime, an empty loop) measured in turn with it in the same run.
"""
