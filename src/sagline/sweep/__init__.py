"""Sweeps: every robot at every pose under every wrench, computed by Dask workers into a folder."""

from sagline.sweep.request import QUANTITIES, Request
from sagline.sweep.result import Sweep, load
from sagline.sweep.running import run
from sagline.sweep.work import Counts

__all__ = ["QUANTITIES", "Counts", "Request", "Sweep", "load", "run"]
