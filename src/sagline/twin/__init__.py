"""Digital twin of a machine: the true robot, its drives, PLCs and network."""

from sagline.twin.injected import KINDS, Injected, fault
from sagline.twin.link import Report
from sagline.twin.machine import Machine
from sagline.twin.server import SCAN, Server

__all__ = ["KINDS", "SCAN", "Injected", "Machine", "Report", "Server", "fault"]
