"""Many recordings: which there are, what is done with each, what came out of all.

plan      recordings found by folder or pattern, their names in the output, their tasks; all of it
steps     what a worker does with one recording: reconstruct, compare, diagnose, by the operations themselves
summary   a row a recording; how far explorations of one object agree
run       all of it, and the files beside the recordings' folders
"""
