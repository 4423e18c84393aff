"""
Many recordings at once
=======================

``pp.batch`` (``palpate batch``) reconstructs, compares and diagnoses a folder of recordings on all cores or a
cluster, takes up again where it stopped, and ends in one table and one page.
"""

import dataclasses
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

import palpate as pp

# two explorations of one object: the embedded one, and one by a noisier sensor
folder = Path(mkdtemp())
first = pp.read_recording("silicone-1-cylinder")
noise = 0.02 * np.random.default_rng(1).standard_normal(first.force_on_tool.shape)
first.save(folder / "first.csv.gz")
dataclasses.replace(first, force_on_tool=first.force_on_tool + noise).save(folder / "second.csv.gz")

done = pp.batch(folder, folder / "results", do="reconstruct", reports=False)
print(done)
done.plot()

# %%
# ``results/summary.csv`` has a row a recording, ``results/index.html`` the table with links:

print((folder / "results" / "summary.csv").read_text())
