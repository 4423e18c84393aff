"""Diagnosis: where a simulated touch leaves the measured one, which effect causes it, how far it shrinks."""

import mechanics as mechanics  # it says where compiled kernels are kept, before the first is decorated
