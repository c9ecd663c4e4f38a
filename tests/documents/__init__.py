"""Writes those parts of the documents that come from the code: `python -m tests.documents FILE...`
(`make docs`).
"""
