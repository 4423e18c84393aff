"""Work in parts: a graph of tasks with results on disk, done by processes here or by a Dask cluster.

graph     Task and Graph: what is to be done, what it needs, the key of its content
record    the file that says that a task is finished, and by which content
worker    a process that does tasks one at a time on one thread; child is its parent's end
driver    which task next: order, memory, retries, what failed with its reason
local     an executor of processes on this machine; cluster: one of Dask workers; engine: which, by flags
"""
