"""
Write a device driver
=====================

A driver is a *wire*: connect, exchange, disconnect, each of which may wait. ``ForcefulDevice`` makes a
device of it that never waits: one thread drains the readings, sends the newest force, and lets go where
anything is wrong. This wire leads to a make-believe handle: a mass on a spring, pushed downwards by a
hand.
"""

import time

import matplotlib.pyplot as plt
import numpy as np
import trimesh

import palpate as pp
from palpate.devices.base import DeviceSpec
from palpate.devices.io_thread import ForcefulDevice, Reading


class Handle:
    spec = DeviceSpec("handle", "a make-believe handle", actuated_axes=("x", "y", "z"), max_force_n=5.0)

    def connect(self):
        self.position, self.velocity = np.array([0.0, 0.0, 0.025]), np.zeros(3)
        self.hand = np.array([0.0, 0.0, -0.6])  # N, a light push
        self.last = time.perf_counter()

    def exchange(self, force_on_tool_n, timeout_s):
        now = time.perf_counter()
        push = self.hand + (0.0 if force_on_tool_n is None else force_on_tool_n)
        for _ in range(max(1, int((now - self.last) / 1e-4))):
            self.velocity += 1e-4 * (push - 6.0 * self.velocity) / 0.15
            self.position = self.position + 1e-4 * self.velocity
        self.last = now
        time.sleep(timeout_s)
        return Reading(self.position.copy(), self.velocity.copy())

    def disconnect(self):
        pass


# %%
# Felt through it: a block whose top is 5 mm below the handle's ball.

block = trimesh.creation.box((0.06, 0.06, 0.03))
model = pp.model_of(block, 20e3, mesh_size_m=0.012)
felt = pp.renderer(model, "fem")
state, _ = felt.step(felt.start(), np.full((1, 3), 1.0))  # far away: what is compiled is ready now
seen = []
with ForcefulDevice(Handle()) as device:
    while not device.read().connected or device.read().sequence < 1:
        time.sleep(0.01)
    device.enable_force()
    begin = time.perf_counter()
    while (now := time.perf_counter() - begin) < 1.0:
        tip = device.read()
        state, forces = felt.step(state, tip.position_m[None])
        device.send_force(forces[0])
        seen.append((now, tip.position_m[2], forces[0][2]))
        time.sleep(0.001)

t, z, force = np.array(seen).T
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
axes[0].plot(t, 1e3 * z)
axes[0].set(ylabel="ball's centre [mm]")
axes[1].plot(t, force)
axes[1].axhline(0.6, color="0.6", linestyle="--")
axes[1].set(xlabel="time [s]", ylabel="force on the tool [N]")

# %%
# The handle comes to rest where the block pushes back with the hand's 0.6 N. In the program the safety
# filter stands between the two, and a conformance suite tries every driver: "Add a device".
