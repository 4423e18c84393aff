"""Work in parts: a graph of tasks with results on disk, done by processes here or by a Dask cluster.

graph     what is to be done, what it needs, the key of its content; the file that says that it is finished
worker    a process that does tasks one at a time on one thread, and measures what they take
driver    which task next: order, memory, retries, what failed with its reason; how far a run is
local     an executor of processes on this machine; cluster: one of Dask workers; engine: which, by flags
"""
