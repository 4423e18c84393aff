"""Work in parts: tasks with results on disk, done by processes here or by a Dask cluster.

tasks     what is to be done, the record by which a finished task is recognised, and how one is done
process   a process of its own for each thread of an executor, with one thread of its libraries
engines   `concurrent.futures` threads of this machine, or Dask's: both hand tasks to such processes
run       which task next: order, memory, retries, what failed with its reason; how far a run is
"""
