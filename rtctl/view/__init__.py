"""The live view: a page on this machine's own address, fed by the public client. Standard library and
numpy.
"""
